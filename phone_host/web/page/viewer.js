// What turns: a camera in orbit, keys, scale and axes. The project's only viewer: `cloud.js` shows a pair in it, `model.js` a scan.
//
// Axes inside: X right, Y up, Z towards the viewer, so that the left camera looks along -Z. A picture is drawn only when the data, the
// camera or the size changed.

import { lengthOf } from './depth.js';
import { CloudLegend } from './legend.js';
import * as three from './vendor/three.js';

/** @typedef {'turned' | 'front' | 'side' | 'above'} ViewName */

/** Yaw and pitch of the views by name, and the distance as a share of the usual one. */
const VIEWS = { turned: [-0.36, 0.22, 1.2], front: [0, 0, 1], side: [-1.25, 0.1, 1.1], above: [0, 1.25, 1.1] };

/** @returns {boolean} whether this browser can show something that turns */
export function canShowClouds() {
  return !!document.createElement('canvas').getContext('webgl2');
}

/** Something that can be turned. What it shows says where its middle is (`place`), how large it is drawn (`zoom`), and gets ready. */
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

  /**
   * Where the thing in the middle is: X right, Y down, Z forward, m, and from how far it is looked at, m; null: there is none.
   * @returns {?{middle: number[], away: number}}
   */
  place() {
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

  /** Go to a view by name, around the thing in the middle. @param {ViewName} name */
  view(name) {
    const place = this.place();
    if (!place) return;
    this.pivot = place.middle;
    const [yaw, pitch, farther] = VIEWS[name];
    const [x, y, z] = place.middle;
    const away = farther * place.away;
    // The front view looks from where the camera stood; turns are about the thing.
    const bearing = [Math.atan2(-x, z) + yaw, Math.asin(y / lengthOf(place.middle)) + pitch];
    const flat = Math.cos(bearing[1]) * away;
    // An orbit that still swings ends here: an update without damping takes all that is left of it.
    const { enableDamping } = this.controls;
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.target.set(x, -y, -z);
    this.camera.position.set(x + flat * Math.sin(bearing[0]), -y + away * Math.sin(bearing[1]), -z + flat * Math.cos(bearing[0]));
    this.camera.near = place.away * 0.02;
    this.camera.far = place.away * 60;
    this.controls.minDistance = place.away * 0.06;
    this.controls.maxDistance = place.away * 12;
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
