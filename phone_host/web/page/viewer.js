// What turns: a camera in orbit, keys, scale and axes. The project's only viewer: `cloud.js` shows a pair in it, `model.js` a scan.
//
// Axes inside: X right, Y up, Z towards the viewer, so that the left camera looks along -Z. A picture is drawn only when the data, the
// camera or the size changed.

import { fitted, lengthOf } from './depth.js';
import { CloudLegend } from './legend.js';
import './vendor/three.js';

const { three } = globalThis;

/** @typedef {'turned' | 'front' | 'side' | 'above'} ViewName */

/** Yaw and pitch of the views by name. */
const VIEWS = { turned: [-0.28, 0.2], front: [0, 0], side: [-1.25, 0.1], above: [0, 1.25] };

/**
 * @typedef {object} Stand  how a thing is looked at; lengths are m, places X right, Y down, Z forward
 * @property {number[]} middle - what it turns about
 * @property {?number} front - from so far the front view is seen; null: from where all fits in, as in the other views
 * @property {number[][]} points - that have to fit in
 * @property {[number, number]} reach - tangents of half the angles across and down that a picture shows at least
 * @property {number} scale - a typical length
 * @property {number} [stray] - share of the points that may lie beyond each edge; missing: as of a pair's
 * @property {[number, number]} [way] - turn and tilt of the front view, rad; missing: as from the places' origin
 */

const dot = (/** @type {number[]} */ a, /** @type {number[]} */ b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @returns {boolean} whether this browser can show something that turns */
export function canShowClouds() {
  return !!document.createElement('canvas').getContext('webgl2');
}

/** Something that can be turned. What it shows says how it is looked at (`stand`), how large it is drawn (`zoom`), and gets ready. */
export class Viewer {
  /**
   * @param {HTMLCanvasElement} canvas - takes the keyboard, too
   * @param {HTMLCanvasElement} over - lies on it, for scale and axes
   * @throws {Error} where there is no WebGL 2
   */
  constructor(canvas, over) {
    this.canvas = canvas;
    this.legend = new CloudLegend(over);
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: 'low-power' });
    this.renderer.setClearAlpha(0);
    this.camera = new three.PerspectiveCamera(45, 1, 0.01, 100);
    this.scene = new three.Scene();
    /** @type {?number[]} */
    this.pivot = null;
    /** Draws over each picture, in the legend's canvas. @type {() => void} */
    this.over = () => undefined;
    this.asked = 0;
    this.controls = orbit(this.camera, canvas, () => this.moved());
    listen(this, canvas);
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
  }

  /** @returns {boolean} whether there is nothing to show */
  isEmpty() {
    return true;
  }

  /** @returns {?Stand} null: there is nothing to look at */
  stand() {
    return null;
  }

  /** Px of the page per unit of tangent. @param {number} w @param {number} h - of the page's picture, px @returns {number} */
  zoom(w, h) {
    return Math.min(w, h);
  }

  /** Before each picture. @param {number} pixels - device pixels per unit of tangent */
  ready(pixels) {
    void pixels;
  }

  /** Go to a view by name: from where the camera stood, or all of it, turned around the thing in the middle. @param {ViewName} name */
  view(name) {
    const stand = this.stand();
    if (!stand) return;
    this.pivot = stand.middle;
    const [yaw, pitch] = VIEWS[name];
    const [x, y, z] = stand.middle;
    const [way, rise] = stand.way ?? [Math.atan2(-x, z), Math.asin(y / lengthOf(stand.middle))];
    const [turn, tilt] = [way + yaw, rise + pitch];
    const right = [Math.cos(turn), 0, -Math.sin(turn)];
    const up = [-Math.sin(tilt) * Math.sin(turn), Math.cos(tilt), -Math.sin(tilt) * Math.cos(turn)];
    const back = [Math.cos(tilt) * Math.sin(turn), Math.sin(tilt), Math.cos(tilt) * Math.cos(turn)];
    let stands = [0, 0, stand.front ?? 0];
    if (name !== 'front' || stand.front === null) {
      const points = stand.points.map(([px, py, pz]) => [px - x, -(py - y), -(pz - z)]);
      const seen = (/** @type {number[]} */ axis) => points.map((point) => ({ across: dot(point, axis), away: -dot(point, back) }));
      const wide = fitted(seen(right), stand.reach[0], stand.stray);
      const high = fitted(seen(up), stand.reach[1], stand.stray);
      stands = [wide.aside, high.aside, Math.max(wide.back, high.back)];
    }
    const target = [x, -y, -z].map((v, k) => v + stands[0] * right[k] + stands[1] * up[k]);
    // An orbit that still swings ends here: an update without damping takes all that is left of it.
    const { enableDamping } = this.controls;
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.target.set(target[0], target[1], target[2]);
    this.camera.position.set(target[0] + stands[2] * back[0], target[1] + stands[2] * back[1], target[2] + stands[2] * back[2]);
    this.camera.near = stand.scale * 0.02;
    this.camera.far = stand.scale * 60 + stands[2];
    this.controls.minDistance = stand.scale * 0.06;
    this.controls.maxDistance = stand.scale * 12 + stands[2];
    this.controls.update();
    this.controls.enableDamping = enableDamping;
    this.draw();
  }

  /** Have the next frame drawn. */
  draw() {
    this.asked ||= requestAnimationFrame(() => this.frame());
  }

  /** The camera moved. */
  moved() {
    this.draw();
  }

  frame() {
    this.asked = 0;
    if (this.isEmpty() || !this.canvas.clientWidth) return;
    const { controls } = this;
    const [w, h] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(w, h, false);
    const zoom = this.zoom(w, h);
    this.camera.aspect = w / h;
    this.camera.fov = (2 * Math.atan(h / 2 / zoom) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    controls.update();
    this.ready(zoom * ratio);
    this.renderer.render(this.scene, this.camera);
    this.legend.draw(this.camera, controls.target, zoom, ratio);
    this.over();
    this.canvas.dataset.drawn = [controls.getAzimuthalAngle(), controls.getPolarAngle(), controls.getDistance()].map((v) => v.toFixed(3)).join(' ');
  }
}

/** A texture's bytes. @param {Uint8Array} rgb @returns {Uint8Array} with alpha */
export function opaque(rgb) {
  const all = new Uint8Array((rgb.length / 3) * 4).fill(255);
  for (let i = 0; i < rgb.length / 3; i++) all.set(rgb.subarray(3 * i, 3 * i + 3), 4 * i);
  return all;
}

/** @param {three.PerspectiveCamera} camera @param {HTMLCanvasElement} canvas @param {() => void} moved */
function orbit(camera, canvas, moved) {
  const controls = new three.OrbitControls(camera, canvas);
  controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
  controls.dampingFactor = 0.12;
  controls.rotateSpeed = 0.7;
  controls.enableZoom = false; // until it has the focus: the wheel scrolls the page
  controls.touches = { ONE: three.TOUCH.ROTATE, TWO: three.TOUCH.DOLLY_PAN };
  controls.addEventListener('change', moved);
  return controls;
}

/** Keys, and the wheel only with the focus. @param {Viewer} viewer @param {HTMLCanvasElement} canvas */
function listen(viewer, canvas) {
  const { controls } = viewer;
  canvas.addEventListener('focus', () => (controls.enableZoom = true));
  canvas.addEventListener('blur', () => (controls.enableZoom = false));
  canvas.addEventListener('pointerdown', () => canvas.focus({ preventScroll: true }), { capture: true });
  canvas.addEventListener('dblclick', () => viewer.view('turned'));
  /** @type {Record<string, () => void>} */
  const keys = {
    ArrowLeft: () => controls.rotateLeft(0.1), ArrowRight: () => controls.rotateLeft(-0.1),
    ArrowUp: () => controls.rotateUp(0.1), ArrowDown: () => controls.rotateUp(-0.1),
    '+': () => controls.dollyIn(0.9), '-': () => controls.dollyOut(0.9), Home: () => viewer.view('turned'),
  };
  canvas.addEventListener('keydown', (event) => {
    const action = event.ctrlKey || event.metaKey || event.altKey ? undefined : keys[event.key];
    if (!action) return;
    event.preventDefault();
    action();
    viewer.draw();
  });
}
