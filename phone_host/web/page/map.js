// Draws a grid of disparities in colours, and the scale below it. No WebGL: this works in every browser.

import { depthOf, disparityAt, disparityOf, evenTicks, isKept, roundDepths, roundMetres } from './depth.js';
import { NONE, pixelOf } from './ramp.js';

/** @typedef {import('./depth.js').Grid} Grid */
/** @typedef {import('./depth.js').Geometry} Geometry */
/** @typedef {import('./depth.js').Limits} Limits */
/** @typedef {'disparity' | 'depth'} Kind */

/**
 * What each cell value looks like.
 * @param {Grid} grid @param {?Geometry} geometry @param {Limits} limits @param {Kind} kind
 * @param {[number, number]} range - darkest and brightest disparity, px
 * @returns {Uint32Array} a pixel for each of the 65536 values
 */
export function palette(grid, geometry, limits, kind, range) {
  const pixels = new Uint32Array(65536).fill(NONE);
  const share = shareOf(geometry, kind, range);
  for (let cell = grid.first; cell < 65536; cell++) {
    const d = disparityOf(grid, cell);
    if (kind === 'depth' && geometry && !isKept(depthOf(geometry, d), limits)) continue;
    pixels[cell] = pixelOf(share(d));
  }
  return pixels;
}

/**
 * Where a disparity lies on the scale: evenly in px, or for depth evenly in its logarithm.
 * @param {?Geometry} geometry @param {Kind} kind @param {[number, number]} range
 * @returns {(d: number) => number} 0 dark .. 1 bright
 */
function shareOf(geometry, kind, [low, high]) {
  if (kind === 'disparity' || !geometry) return (d) => (d - low) / (high - low);
  const [least, most] = [Math.log(Math.max(low + geometry.doffs, 1e-3)), Math.log(Math.max(high + geometry.doffs, 2e-3))];
  return (d) => (Math.log(d + geometry.doffs) - least) / (most - least);
}

/**
 * Marks of the scale: metres where they are known.
 * @param {?Geometry} geometry @param {Kind} kind @param {[number, number]} range
 * @returns {{at: number, words: string}[]} places from 0 to 1, in order, none too close to the one before
 */
export function marks(geometry, kind, range) {
  const [low, high] = range;
  const share = shareOf(geometry, kind, range);
  const metric = geometry && low + geometry.doffs > 0;
  const all = metric
    ? roundDepths(depthOf(geometry, high), depthOf(geometry, low)).map((z) => ({ at: share(disparityAt(geometry, z)), words: roundMetres(z) }))
    : evenTicks(low, high, 4).map((d) => ({ at: share(d), words: `${d} px` }));
  let taken = -1;
  return all
    .sort((a, b) => a.at - b.at)
    .filter(({ at }) => at >= 0.04 && at <= 0.96 && at - taken >= 0.13 && ((taken = at), true));
}

/** A canvas that shows grids; its buffers are made once for each size. */
export class DepthMap {
  /** @param {HTMLCanvasElement} canvas @param {HTMLElement} scale - takes the marks */
  constructor(canvas, scale) {
    this.canvas = canvas;
    this.scale = scale;
    this.pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    /** @type {?ImageData} */
    this.frame = null;
    this.labels = '';
    this.key = '';
    /** @type {Uint32Array} */
    this.pixels = new Uint32Array(0);
  }

  /** @param {Grid} grid @param {?Geometry} geometry @param {Limits} limits @param {Kind} kind @param {[number, number]} range */
  show(grid, geometry, limits, kind, range) {
    if (!this.frame || this.frame.width !== grid.columns || this.frame.height !== grid.rows) {
      this.canvas.width = grid.columns;
      this.canvas.height = grid.rows;
      this.frame = this.pen.createImageData(grid.columns, grid.rows);
    }
    const key = JSON.stringify([grid.low, grid.scale, grid.first, geometry, limits, kind, range]);
    if (key !== this.key) {
      this.key = key;
      this.pixels = palette(grid, geometry, limits, kind, range);
      this.mark(marks(geometry, kind, range));
    }
    const out = new Uint32Array(this.frame.data.buffer);
    const { pixels } = this;
    const { cells } = grid;
    for (let i = 0; i < out.length; i++) out[i] = pixels[cells[i]];
    this.pen.putImageData(this.frame, 0, 0);
  }

  /** Show nothing. */
  clear() {
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.key = '';
    this.mark([]);
  }

  /** @param {{at: number, words: string}[]} found */
  mark(found) {
    const labels = JSON.stringify(found);
    if (labels === this.labels) return;
    this.labels = labels;
    while (this.scale.children.length < found.length) this.scale.append(document.createElement('span'));
    [...this.scale.children].forEach((child, k) => {
      const label = /** @type {HTMLElement} */ (child);
      label.hidden = k >= found.length;
      if (label.hidden) return;
      label.textContent = found[k].words;
      label.style.left = `${(100 * found[k].at).toFixed(1)}%`;
    });
  }
}
