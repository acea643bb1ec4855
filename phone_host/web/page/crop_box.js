// A box around a surface that is pulled by its six faces. Lengths are m, places in the axes of the model.

import './vendor/three.js';

const { Vector3 } = globalThis.three;

/** @typedef {{low: number[], high: number[]}} Box */

/** Half of 44 px: what a finger hits. */
const REACH_PX = 22;
const DOT_PX = 7;
const LEAST_M = 0.002;
/** A face that is seen from so near its own direction cannot be pulled: px of the page a metre. */
const LEAST_PX_PER_M = 30;
const HUE = '#ffd43b';

/** Corner k has the high side of axis a where bit a of k is set. */
const CORNERS = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1, (k >> 1) & 1, (k >> 2) & 1]);
const EDGES = CORNERS.flatMap((_, k) => [1, 2, 4].filter((bit) => !(k & bit)).map((bit) => [k, k | bit]));
const FACES = [0, 1, 2].flatMap((axis) => [0, 1].map((side) => ({ axis, side })));

const FORM = /^(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)@(-?\d+(?:\.\d+)?),(-?\d+(?:\.\d+)?),(-?\d+(?:\.\d+)?)$/;

/** A box as `--box` has it. @param {Box} box @returns {string} WxHxD@X,Y,Z in whole mm, at least 1 wide */
export function boxText({ low, high }) {
  const sides = low.map((least, axis) => Math.max(1, Math.round((high[axis] - least) * 1000)));
  const middle = low.map((least, axis) => Math.round((high[axis] + least) * 500));
  return `${sides.join('x')}@${middle.join(',')}`;
}

/** @param {string} text - WxHxD@X,Y,Z, mm @returns {?Box} null: it is none */
export function boxOf(text) {
  const found = FORM.exec(text.replaceAll(' ', ''));
  if (!found) return null;
  const values = found.slice(1).map((part) => Number(part) / 1000);
  const [sides, middle] = [values.slice(0, 3), values.slice(3)];
  if (Math.min(...sides) <= 0) return null;
  return { low: middle.map((at, axis) => at - sides[axis] / 2), high: middle.map((at, axis) => at + sides[axis] / 2) };
}

/** Draws the box over a viewer, and lets its faces be pulled. */
export class CropBox {
  /**
   * @param {import('./model.js').Model} viewer
   * @param {(box: Box, done: boolean) => void} pulled - called while a face is pulled, and once more when it is let go
   */
  constructor(viewer, pulled) {
    this.viewer = viewer;
    this.pulled = pulled;
    /** @type {?Box} */
    this.box = null;
    /** @type {?{pointer: number, axis: number, side: number, from: number, at: number[], way: number[]}} */
    this.held = null;
    viewer.over = () => this.draw();
    const { canvas } = viewer;
    canvas.addEventListener('pointerdown', (event) => this.down(event), { capture: true });
    canvas.addEventListener('pointermove', (event) => this.move(event), { capture: true });
    for (const kind of /** @type {const} */ (['pointerup', 'pointercancel'])) canvas.addEventListener(kind, (event) => this.up(event), { capture: true });
  }

  /** @param {?Box} box - null: none */
  show(box) {
    this.box = box;
    this.viewer.draw();
  }

  /** @param {number[]} place @returns {number[]} px of the page, and whether it lies before the camera */
  spot(place) {
    const [x, y, z] = this.viewer.ofCamera(place);
    const seen = new Vector3(x, -y, -z).project(this.viewer.camera);
    const { clientWidth, clientHeight } = this.viewer.canvas;
    return [((seen.x + 1) / 2) * clientWidth, ((1 - seen.y) / 2) * clientHeight, seen.z < 1 ? 1 : 0];
  }

  /** The faces that can be pulled now: where they are held, and where a metre outwards leads on the page. */
  handles() {
    const { box } = this;
    if (!box) return [];
    const step = 0.01 * Math.hypot(...box.low.map((least, axis) => box.high[axis] - least));
    return FACES.map(({ axis, side }) => {
      const place = box.low.map((least, a) => (a === axis ? [least, box.high[a]][side] : (least + box.high[a]) / 2));
      const farther = place.map((value, a) => (a === axis ? value + step : value));
      const [at, end] = [this.spot(place), this.spot(farther)];
      const way = [(end[0] - at[0]) / step, (end[1] - at[1]) / step];
      return { axis, side, at, way };
    }).filter(({ at, way }) => at[2] && Math.hypot(...way) > LEAST_PX_PER_M);
  }

  draw() {
    const { box, viewer } = this;
    if (!box) return;
    const corners = CORNERS.map((bits) => this.spot(bits.map((bit, axis) => (bit ? box.high : box.low)[axis])));
    for (const [a, b] of EDGES) if (corners[a][2] && corners[b][2]) viewer.legend.line([corners[a].slice(0, 2), corners[b].slice(0, 2)], HUE);
    const handles = this.handles();
    for (const { at } of handles) viewer.legend.dot(at[0], at[1], DOT_PX, HUE);
    viewer.canvas.dataset.handles = handles.map(({ at, way }) => [at[0], at[1], ...way].map((v) => v.toFixed(1)).join(',')).join(' ');
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (!this.box || this.held) return;
    const bounds = this.viewer.canvas.getBoundingClientRect();
    const at = [event.clientX - bounds.left, event.clientY - bounds.top];
    const away = (/** @type {{at: number[]}} */ handle) => Math.hypot(handle.at[0] - at[0], handle.at[1] - at[1]);
    const [nearest] = this.handles().sort((a, b) => away(a) - away(b));
    if (!nearest || away(nearest) > REACH_PX) return;
    event.stopImmediatePropagation(); // the orbit does not hear of it
    event.preventDefault();
    this.viewer.canvas.setPointerCapture(event.pointerId);
    const { axis, side, way } = nearest;
    this.held = { pointer: event.pointerId, axis, side, from: (side ? this.box.high : this.box.low)[axis], at, way };
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { held, box } = this;
    if (!held || !box || held.pointer !== event.pointerId) return;
    event.stopImmediatePropagation();
    const bounds = this.viewer.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - bounds.left - held.at[0], event.clientY - bounds.top - held.at[1]];
    const by = (x * held.way[0] + y * held.way[1]) / (held.way[0] ** 2 + held.way[1] ** 2);
    const { axis, side } = held;
    if (side) box.high[axis] = Math.max(held.from + by, box.low[axis] + LEAST_M);
    else box.low[axis] = Math.min(held.from + by, box.high[axis] - LEAST_M);
    this.pulled(box, false);
    this.viewer.draw();
  }

  /** @param {PointerEvent} event */
  up(event) {
    if (!this.held || this.held.pointer !== event.pointerId) return;
    event.stopImmediatePropagation();
    this.held = null;
    if (this.box) this.pulled(this.box, true);
  }
}
