// The pictures of the newest pair: left and right with scan lines, disparity or depth in colours, the cloud.

import { steadyRange } from './depth.js';
import { byId, data, show } from './dom.js';
import { DepthMap } from './map.js';
import { Measure } from './measure.js';
import { pointing } from './pointing.js';

/** @typedef {import('./message.js').Pair} Pair */

const NO_WEBGL = 'This browser cannot draw the cloud (no WebGL 2). Everything else works; the cloud can be downloaded.';

export class Live {
  /** @param {(from: import('./pointing.js').Spot, to: import('./pointing.js').Spot, done: boolean) => boolean} drag */
  constructor(drag) {
    /** @type {?Pair} */
    this.pair = null;
    /** @type {import('./map.js').Kind} */
    this.kind = 'depth';
    /** @type {?[number, number]} */
    this.range = null;
    this.map = new DepthMap(/** @type {HTMLCanvasElement} */ (byId('map')), byId('map-marks'));
    const frames = [byId('map-frame'), byId('left-frame')];
    this.measure = new Measure(byId('readout'), frames);
    for (const frame of frames)
      pointing(frame, () => this.pair?.head ?? { width: 1, height: 1 }, {
        hover: (at) => this.measure.hover(this.pair, at), tap: (at) => this.measure.tap(this.pair, at), drag, clear: () => this.measure.clear(),
      });
    /** @type {?import('./cloud.js').Cloud} */
    this.cloud = null;
    this.startCloud();
  }

  /** The viewer is heavy: it comes after the first pictures. */
  async startCloud() {
    const { Cloud, canShowClouds } = await import('./cloud.js');
    try {
      if (!canShowClouds()) throw new Error(NO_WEBGL);
      this.cloud = new Cloud(/** @type {HTMLCanvasElement} */ (byId('cloud')), /** @type {HTMLCanvasElement} */ (byId('cloud-over')));
    } catch {
      byId('cloud-none').textContent = NO_WEBGL;
      show(byId('cloud-none'), true);
      return;
    }
    for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll('[data-view]')))
      button.addEventListener('click', () => this.cloud?.view(/** @type {any} */ (button.dataset.view)));
    byId('cloud-colours').addEventListener('change', (event) => this.cloud?.colourByDepth(/** @type {HTMLInputElement} */ (event.target).checked));
    if (this.pair) this.draw();
  }

  /** @param {Pair} pair - its bitmaps are ours from now on */
  show(pair) {
    const old = this.pair;
    this.pair = { ...pair, left: pair.left ?? old?.left ?? null, right: pair.right ?? old?.right ?? null, grid: pair.grid ?? old?.grid ?? null };
    for (const side of /** @type {const} */ (['left', 'right'])) {
      if (!pair[side]) continue;
      paint(/** @type {HTMLCanvasElement} */ (byId(side)), pair[side]);
      if (old?.[side] && old[side] !== this.pair[side]) old[side].close();
    }
    this.draw();
    const frame = byId('views');
    data(frame, 'pair', String(pair.head.number));
    data(frame, 'lines', pair.head.way[1] ? 'columns' : 'rows');
    show(byId('no-pair'), false);
    const aspect = `${pair.head.width} / ${pair.head.height}`;
    if (frame.style.getPropertyValue('--aspect') !== aspect) frame.style.setProperty('--aspect', aspect);
  }

  draw() {
    const { pair } = this;
    if (!pair?.grid) return;
    const { head, grid } = pair;
    const limits = { near: head.near, far: head.far };
    this.range = steadyRange(this.range, head.range);
    this.map.show(grid, head.geometry, limits, head.geometry ? this.kind : 'disparity', this.range);
    show(byId('cloud-wait'), !head.geometry);
    if (head.geometry && this.cloud) this.cloud.show(grid, head.geometry, limits, pair.left && /** @type {HTMLCanvasElement} */ (byId('left')), this.range);
  }

  /** @param {import('./map.js').Kind} kind */
  as(kind) {
    this.kind = kind;
    this.draw();
  }
}

/** @param {HTMLCanvasElement} canvas @param {ImageBitmap} picture */
function paint(canvas, picture) {
  if (canvas.width !== picture.width || canvas.height !== picture.height) {
    canvas.width = picture.width;
    canvas.height = picture.height;
  }
  /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')).drawImage(picture, 0, 0);
}
