// The pictures of the newest pair: left and right with scan lines, disparity or depth in colours, the cloud.

import { steadyRange } from './depth.js';
import { byId, data, show, text } from './dom.js';
import { DepthMap } from './map.js';
import { Measure } from './measure.js';
import { pointing } from './pointing.js';

/** @typedef {import('./message.js').Pair} Pair */

const NO_WEBGL = 'This browser cannot draw the cloud (no WebGL 2). Everything else works; the cloud can be downloaded.';
const NO_DEPTH = 'No depth in this run: calibrate, or choose a calibration.';

export class Live {
  /** @param {(from: import('./pointing.js').Spot, to: import('./pointing.js').Spot, done: boolean) => boolean} drag */
  constructor(drag) {
    /** @type {?Pair} */
    this.pair = null;
    /** @type {import('./map.js').Kind} */
    this.kind = 'depth';
    /** @type {?[number, number]} */
    this.range = null;
    /** Number of the run whose pairs are shown. */
    this.begun = 0;
    this.map = new DepthMap(/** @type {HTMLCanvasElement} */ (byId('map')), byId('map-marks'));
    const frames = [byId('map-frame'), byId('left-frame')];
    this.measure = new Measure(byId('readout'), frames);
    for (const frame of frames)
      pointing(frame, () => this.pair?.head ?? { width: 1, height: 1 }, {
        hover: (at) => this.measure.hover(this.pair, at), tap: (at) => this.measure.tap(this.pair, at), drag, clear: () => this.measure.clear(),
      });
    /** @type {?import('./cloud.js').Cloud} */
    this.cloud = null;
    this.hasAskedForCloud = false;
  }

  /** The viewer is heavy: it comes after the first pictures. */
  async startCloud() {
    this.hasAskedForCloud = true;
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
    if (pair.head.begun < this.begun) return;
    this.begin(pair.head.begun);
    const old = this.pair;
    const grid = pair.head.range && (pair.grid ?? old?.grid ?? null);
    this.pair = { ...pair, left: pair.left ?? old?.left ?? null, right: pair.right ?? old?.right ?? null, grid };
    for (const side of /** @type {const} */ (['left', 'right'])) {
      if (!pair[side]) continue;
      paint(/** @type {HTMLCanvasElement} */ (byId(side)), pair[side]);
      if (old?.[side] && old[side] !== this.pair[side]) old[side].close();
    }
    this.draw();
    const frame = byId('views');
    data(frame, 'pair', String(pair.head.number));
    const lines = !pair.head.range ? 'none' : pair.head.way[1] ? 'columns' : 'rows';
    data(frame, 'lines', lines);
    text(byId('pictures-words'), lines === 'none' ? 'Not rectified: shown as the cameras see it' : 'Rectified: each point lies on the same line in both images');
    if (!this.hasAskedForCloud) this.startCloud();
    const aspect = `${pair.head.width} / ${pair.head.height}`;
    if (frame.style.getPropertyValue('--aspect') !== aspect) frame.style.setProperty('--aspect', aspect);
  }

  /** Nothing of an earlier run stays. @param {number} begun - number of the run that is shown from now on */
  begin(begun) {
    if (begun === this.begun) return;
    this.begun = begun;
    for (const side of /** @type {const} */ (['left', 'right'])) {
      this.pair?.[side]?.close();
      wipe(/** @type {HTMLCanvasElement} */ (byId(side)));
    }
    this.pair = this.range = null;
    this.measure.clear();
    this.draw();
    delete byId('views').dataset.pair;
  }

  /** What stands where there is no depth and no cloud. */
  wait() {
    const head = this.pair?.head;
    const isFlat = !!head && !head.range;
    text(byId('no-pair'), isFlat ? NO_DEPTH : 'No pair yet');
    show(byId('no-pair'), !head?.range);
    text(byId('cloud-wait'), isFlat ? NO_DEPTH : 'No cloud yet: it needs a calibration');
    show(byId('cloud-wait'), !!head && !head.geometry);
    if (head?.range) return;
    this.map.clear();
    this.cloud?.clear();
  }

  draw() {
    const { pair } = this;
    this.wait();
    if (!pair?.grid || !pair.head.range) return;
    const { head, grid } = pair;
    const limits = { near: head.near, far: head.far };
    this.range = steadyRange(this.range, head.range);
    this.map.show(grid, head.geometry, limits, head.geometry ? this.kind : 'disparity', this.range);
    if (head.geometry && this.cloud) this.cloud.show(grid, head.geometry, limits, pair.left && /** @type {HTMLCanvasElement} */ (byId('left')), this.range);
  }

  /** @param {import('./map.js').Kind} kind */
  as(kind) {
    this.kind = kind;
    this.draw();
  }
}

/** @param {HTMLCanvasElement} canvas */
function wipe(canvas) {
  canvas.getContext('2d')?.clearRect(0, 0, canvas.width, canvas.height);
}

/** @param {HTMLCanvasElement} canvas @param {ImageBitmap} picture */
function paint(canvas, picture) {
  if (canvas.width !== picture.width || canvas.height !== picture.height) {
    canvas.width = picture.width;
    canvas.height = picture.height;
  }
  /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')).drawImage(picture, 0, 0);
}
