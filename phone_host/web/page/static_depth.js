// The script of static pages with depth: a pointer reads metres, the cloud turns by the same viewer as on the live page. Prebuilt,
// without three.js, which stands before it: phone_host/report/page_depth.js. It takes all values from attributes (report/depth_view.py and model_view.py write them) and loads nothing.

import { Cloud } from './cloud.js';
import { connectCopying } from './copying.js';
import { cellAt, depthOf, metres, placeOf, sigmaOf } from './depth.js';
import { Model } from './model.js';

/** @typedef {import('./depth.js').Grid} Grid */
/** @typedef {import('./depth.js').Geometry} Geometry */
/** @typedef {Grid & Geometry & {way: [number, number], range: [number, number]}} Values */

const CUT = 1;
const FIRST = 2;

/** @param {string} text - base64 @returns {Uint8Array} */
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/** @param {HTMLElement} root - a .depthview @returns {Values} */
function valuesOf(root) {
  const view = JSON.parse(/** @type {string} */ (root.dataset.view));
  const cells = new Uint16Array(bytes(/** @type {string} */ (root.dataset.grid)).buffer);
  return { ...view, cells, first: FIRST, scale: (65535 - FIRST) / (view.high - view.low) };
}

/** What is known of a pixel. @param {Values} m @param {number} x @param {number} y @param {{cell: number, d: number}} at @returns {string} */
function words(m, x, y, { cell, d }) {
  const where = `, x ${x}, y ${y} px`;
  if (cell === CUT) return `cut: outside the depth limits${where}`;
  if (cell < FIRST) return `no depth here${where}`;
  if (!m.focal) return `${d.toFixed(2)} px disparity${where}`;
  const z = depthOf(m, d);
  const [across, down] = placeOf(m, x, y, z);
  return `${metres(z, sigmaOf(m, z))}${where} (X ${across.toFixed(3)} m, Y ${down.toFixed(3)} m)`;
}

/** @param {HTMLElement} root @param {Values} m */
function readDepth(root, m) {
  const readout = /** @type {HTMLElement} */ (root.querySelector('.readout'));
  const sides = /** @type {HTMLElement[]} */ ([...root.querySelectorAll('[data-side]')]);
  const at = [m.width >> 1, m.height >> 1];
  /** @param {number} toX @param {number} toY */
  function show(toX, toY) {
    const found = cellAt(m, toX, toY);
    const [x, y] = [found.column * m.step, found.row * m.step];
    at[0] = x;
    at[1] = y;
    readout.textContent = words(m, x, y, found);
    for (const side of sides) {
      const dot = /** @type {HTMLElement} */ (side.querySelector('i'));
      const [right, down] = side.dataset.side === 'right' ? m.way : [0, 0];
      const [px, py] = [right ? x + right * found.d : x, down ? y + down * found.d : y];
      dot.hidden = !(px >= 0 && py >= 0 && px < m.width && py < m.height);
      dot.style.left = `${((px + 0.5) / m.width) * 100}%`;
      dot.style.top = `${((py + 0.5) / m.height) * 100}%`;
    }
  }
  for (const side of sides.filter((one) => one.dataset.side === 'left')) {
    const point = (/** @type {PointerEvent} */ event) => {
      const box = side.getBoundingClientRect();
      show(((event.clientX - box.left) / box.width) * m.width - 0.5, ((event.clientY - box.top) / box.height) * m.height - 0.5);
    };
    side.addEventListener('pointermove', point);
    side.addEventListener('pointerdown', point);
    side.addEventListener('keydown', (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!way) return;
      event.preventDefault();
      const by = m.step * (event.shiftKey ? 10 : 1);
      show(at[0] + way[0] * by, at[1] + way[1] * by);
    });
  }
}

/** @param {HTMLElement} root - a .cloudview @param {HTMLElement} pictures - the .depthview of the same pair @param {Values} m */
async function turnCloud(root, pictures, m) {
  const [canvas, over] = /** @type {HTMLCanvasElement[]} */ ([...root.querySelectorAll('canvas')]);
  const left = /** @type {HTMLImageElement} */ (pictures.querySelector('[data-side=left] img'));
  try {
    const cloud = new Cloud(canvas, over);
    await left.decode();
    cloud.show(m, m, { near: null, far: null }, left, m.range);
    connectViews(root, cloud);
  } catch {
    tellNone(root);
  }
}

/** @param {HTMLElement} root - a .modelview */
function turnModel(root) {
  const [canvas, over] = /** @type {HTMLCanvasElement[]} */ ([...root.querySelectorAll('canvas')]);
  const { mesh, points, triangles, colours, noise, seen } = /** @type {Record<string, string>} */ (root.dataset);
  try {
    const model = new Model(canvas, over);
    const shown = JSON.parse(mesh);
    model.stands(shown.axes);
    model.show({
      ...shown,
      points: new Uint16Array(bytes(points).buffer),
      triangles: new Uint32Array(bytes(triangles).buffer),
      colours: bytes(colours),
      noise: bytes(noise),
      seen: bytes(seen),
    });
    connectViews(root, model);
    for (const choice of /** @type {NodeListOf<HTMLInputElement>} */ (root.querySelectorAll('input[data-paint]')))
      choice.addEventListener('change', () => model.paint(/** @type {any} */ (choice.dataset.paint)));
  } catch {
    tellNone(root);
  }
}

/** @param {HTMLElement} root @param {import('./viewer.js').Viewer} viewer */
function connectViews(root, viewer) {
  for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (root.querySelectorAll('button[data-to]')))
    button.addEventListener('click', () => viewer.view(/** @type {any} */ (button.dataset.to)));
}

/** Say that this browser cannot draw it. @param {HTMLElement} root */
function tellNone(root) {
  /** @type {HTMLElement} */ (root.querySelector('.nocloud')).hidden = false;
}

/** @type {?{root: HTMLElement, m: Values}} */
let last = null;
for (const root of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('.depthview, .cloudview, .modelview'))) {
  if (root.matches('.modelview')) turnModel(root);
  else if (root.matches('.depthview')) {
    last = { root, m: valuesOf(root) };
    readDepth(root, last.m);
  } else if (last) turnCloud(root, last.root, last.m);
}
connectCopying();
