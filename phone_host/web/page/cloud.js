// The point cloud: disparity and colours are textures, the vertex shader reprojects. The project's only viewer: the live page loads this
// module, the static pages hold it inlined.
//
// There are no vertex buffers: a point's number is gl_VertexID. Axes inside: X right, Y up, Z towards the viewer, so that the left camera
// looks along -Z. A picture is drawn only when the data, the camera or the size changed.

import { fitted, lengthOf, middleOf, places } from './depth.js';
import { CloudLegend } from './legend.js';
import { RAMP } from './ramp.js';
import * as three from './vendor/three.js';

/** @typedef {import('./depth.js').Grid} Grid */
/** @typedef {import('./depth.js').Geometry} Geometry */
/** @typedef {import('./depth.js').Limits} Limits */
/** @typedef {'turned' | 'front' | 'side' | 'above'} ViewName */

/** Yaw and pitch of the views by name. */
const VIEWS = { turned: [-0.28, 0.2], front: [0, 0], side: [-1.25, 0.1], above: [0, 1.25] };

const dot = (/** @type {number[]} */ a, /** @type {number[]} */ b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

const VERTEX = `
precision highp float;
precision highp usampler2D;
uniform usampler2D cells;
uniform sampler2D picture;
uniform sampler2D ramp;
uniform ivec2 size;
uniform int thin;
uniform float stepPx, low, scale, focal, product, doffs, near, far, pixels;
uniform uint first;
uniform vec2 centre, whole, range;
uniform bool byDepth;
out vec3 colour;
void main() {
  int columns = (size.x + thin - 1) / thin;
  ivec2 at = ivec2(gl_VertexID % columns, gl_VertexID / columns) * thin;
  uint cell = texelFetch(cells, at, 0).r;
  float d = low + float(cell - first) / scale;
  float z = product / (d + doffs);
  bool kept = cell >= first && d + doffs > 0.0 && z >= near && z <= far && at.y < size.y;
  vec2 xy = vec2(at) * stepPx;
  vec4 seen = modelViewMatrix * vec4((xy.x - centre.x) * z / focal, -(xy.y - centre.y) * z / focal, -z, 1.0);
  gl_Position = kept ? projectionMatrix * seen : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = clamp(1.25 * stepPx * float(thin) * z / focal * pixels / max(-seen.z, 1e-6), 1.0, 24.0);
  float share = clamp((log(d + doffs) - log(range.x)) / (log(range.y) - log(range.x)), 0.0, 1.0);
  colour = byDepth ? texture(ramp, vec2(share, 0.5)).rgb : texture(picture, (xy + 0.5) / whole).rgb;
}`;

const FRAGMENT = `
precision mediump float;
in vec3 colour;
out vec4 shown;
void main() { shown = vec4(colour, 1.0); }`;

/** @returns {boolean} whether this browser can show a cloud */
export function canShowClouds() {
  return !!document.createElement('canvas').getContext('webgl2');
}

/** A cloud that can be turned. */
export class Cloud {
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
    this.material = shaders();
    this.points = new three.Points(new three.BufferGeometry(), this.material);
    this.points.frustumCulled = false;
    this.points.visible = false;
    this.scene.add(this.points);
    /** @type {?{grid: Grid, geometry: Geometry, limits: Limits}} */
    this.data = null;
    /** @type {?number[]} */
    this.pivot = null;
    this.asked = 0;
    this.thin = 1;
    this.lastMove = 0;
    this.slow = 0;
    this.rest = 0;
    this.controls = orbit(this.camera, canvas, () => this.moved());
    listen(this, canvas);
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
  }

  /**
   * Show a grid; the camera stays where it is, but at the first one.
   * @param {Grid} grid @param {Geometry} geometry @param {Limits} limits
   * @param {?(ImageBitmap | HTMLImageElement | HTMLCanvasElement)} picture - the left image; null: the last one stays
   * @param {[number, number]} range - disparities of the colours' ends, px
   */
  show(grid, geometry, limits, picture, range) {
    const { uniforms } = this.material;
    put(uniforms.cells, grid);
    if (picture) paint(uniforms.picture, picture);
    const values = {
      stepPx: grid.step, low: grid.low, scale: grid.scale, first: grid.first, focal: geometry.focal, doffs: geometry.doffs,
      product: geometry.focal * geometry.baseline, near: limits.near ?? 0, far: limits.far ?? 1e9,
    };
    for (const [name, value] of Object.entries(values)) uniforms[name].value = value;
    uniforms.size.value = [grid.columns, grid.rows];
    uniforms.centre.value = [geometry.cx, geometry.cy];
    uniforms.whole.value = [grid.width, grid.height];
    uniforms.range.value = range.map((d) => Math.max(d + geometry.doffs, 1e-3));
    this.points.visible = true;
    this.data = { grid, geometry, limits };
    if (!this.pivot && (this.pivot = middleOf(grid, geometry, limits))) this.view('turned');
    this.draw();
  }

  /** Show nothing; the camera stays. */
  clear() {
    if (!this.data) return;
    this.points.visible = false;
    this.renderer.render(this.scene, this.camera);
    this.legend.clear();
    this.data = null;
    delete this.canvas.dataset.drawn;
  }

  /** Colour points by their depth instead of by the picture. @param {boolean} on */
  colourByDepth(on) {
    this.material.uniforms.byDepth.value = on;
    this.draw();
  }

  /** Go to a view by name: from where the camera stood, or all of the cloud, turned around the thing in the middle. @param {ViewName} name */
  view(name) {
    if (!this.data) return;
    const { grid, geometry, limits } = this.data;
    this.pivot = middleOf(grid, geometry, limits) ?? this.pivot ?? [0, 0, 1];
    const [yaw, pitch] = VIEWS[name];
    const [x, y, z] = this.pivot;
    const [turn, tilt] = [Math.atan2(-x, z) + yaw, Math.asin(y / lengthOf(this.pivot)) + pitch];
    const right = [Math.cos(turn), 0, -Math.sin(turn)];
    const up = [-Math.sin(tilt) * Math.sin(turn), Math.cos(tilt), -Math.sin(tilt) * Math.cos(turn)];
    const back = [Math.cos(tilt) * Math.sin(turn), Math.sin(tilt), Math.cos(tilt) * Math.cos(turn)];
    let stands = [0, 0, lengthOf(this.pivot)];
    if (name !== 'front') {
      const points = places(grid, geometry, limits).map(([px, py, pz]) => [px - x, y - py, z - pz]);
      const seen = (/** @type {number[]} */ axis) => points.map((point) => ({ across: dot(point, axis), away: -dot(point, back) }));
      const wide = fitted(seen(right), grid.width / 2 / geometry.focal);
      const high = fitted(seen(up), grid.height / 2 / geometry.focal);
      stands = [wide.aside, high.aside, Math.max(wide.back, high.back)];
    }
    const target = [x, -y, -z].map((v, k) => v + stands[0] * right[k] + stands[1] * up[k]);
    // An orbit that still swings ends here: an update without damping takes all that is left of it.
    const { enableDamping } = this.controls;
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.target.set(target[0], target[1], target[2]);
    this.camera.position.set(target[0] + stands[2] * back[0], target[1] + stands[2] * back[1], target[2] + stands[2] * back[2]);
    this.camera.near = z * 0.02;
    this.camera.far = z * 60 + stands[2];
    this.controls.minDistance = z * 0.06;
    this.controls.maxDistance = z * 12 + stands[2];
    this.controls.update();
    this.controls.enableDamping = enableDamping;
    this.draw();
  }

  /** Have the next frame drawn. */
  draw() {
    this.asked ||= requestAnimationFrame(() => this.frame());
  }

  /** While it moves, points are thinned on slow machines; at rest all are shown. */
  moved() {
    const now = performance.now();
    const took = now - this.lastMove;
    this.lastMove = now;
    if (took < 400) this.slow = 0.7 * this.slow + 0.3 * took;
    this.thin = this.slow > 70 ? 3 : this.slow > 40 ? 2 : 1;
    clearTimeout(this.rest);
    this.rest = window.setTimeout(() => {
      this.thin = 1;
      this.draw();
    }, 200);
    this.draw();
  }

  frame() {
    this.asked = 0;
    if (!this.data || !this.canvas.clientWidth) return;
    const { controls } = this;
    const { grid, geometry } = this.data;
    const [w, h] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(w, h, false);
    // What the left camera sees fits in: the same angle across the tighter side.
    const zoom = Math.min(w / grid.width, h / grid.height) * geometry.focal;
    this.camera.aspect = w / h;
    this.camera.fov = (2 * Math.atan(h / 2 / zoom) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    controls.update();
    const { uniforms } = this.material;
    uniforms.thin.value = this.thin;
    uniforms.pixels.value = zoom * ratio;
    const count = Math.ceil(grid.columns / this.thin) * Math.ceil(grid.rows / this.thin);
    this.points.geometry.setDrawRange(0, count);
    this.renderer.render(this.scene, this.camera);
    this.legend.draw(this.camera, controls.target, zoom, ratio);
    this.canvas.dataset.drawn = [controls.getAzimuthalAngle(), controls.getPolarAngle(), controls.getDistance()].map((v) => v.toFixed(3)).join(' ');
  }
}

/** @returns {three.ShaderMaterial} */
function shaders() {
  const ramp = new three.DataTexture(opaque(RAMP), RAMP.length / 3, 1);
  ramp.magFilter = ramp.minFilter = three.LinearFilter;
  ramp.needsUpdate = true;
  const names = ['thin', 'stepPx', 'low', 'scale', 'focal', 'product', 'doffs', 'near', 'far', 'pixels', 'first'];
  const uniforms = {
    ...Object.fromEntries(names.map((name) => [name, { value: 1 }])),
    size: { value: [1, 1] }, centre: { value: [0, 0] }, whole: { value: [1, 1] }, range: { value: [1, 2] },
    byDepth: { value: false }, cells: { value: null }, picture: { value: null }, ramp: { value: ramp },
  };
  return new three.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, glslVersion: three.GLSL3, uniforms });
}

/** @param {Uint8Array} rgb @returns {Uint8Array} with alpha */
function opaque(rgb) {
  const all = new Uint8Array((rgb.length / 3) * 4).fill(255);
  for (let i = 0; i < rgb.length / 3; i++) all.set(rgb.subarray(3 * i, 3 * i + 3), 4 * i);
  return all;
}

/** Put cells into an R16UI texture, the same one as long as the size stays. @param {{value: any}} uniform @param {Grid} grid */
function put(uniform, grid) {
  const old = uniform.value;
  if (old && old.image.width === grid.columns && old.image.height === grid.rows) old.image.data = grid.cells;
  else {
    old?.dispose();
    const made = new three.DataTexture(grid.cells, grid.columns, grid.rows, three.RedIntegerFormat, three.UnsignedShortType);
    made.internalFormat = 'R16UI';
    made.magFilter = made.minFilter = three.NearestFilter;
    made.unpackAlignment = 2;
    uniform.value = made;
  }
  uniform.value.needsUpdate = true;
}

/**
 * Take a picture as colours, without colour management: the shader passes them on as they are.
 * @param {{value: any}} uniform @param {ImageBitmap | HTMLImageElement | HTMLCanvasElement} picture
 */
function paint(uniform, picture) {
  const old = uniform.value;
  // A canvas changes its size under the texture: the size is kept beside it.
  const size = `${picture.width}x${picture.height}`;
  if (old && old.userData.size === size) old.image = picture;
  else {
    old?.dispose();
    const made = new three.Texture(picture);
    made.colorSpace = three.NoColorSpace;
    made.flipY = false;
    made.generateMipmaps = false;
    made.magFilter = made.minFilter = three.LinearFilter;
    made.userData.size = size;
    uniform.value = made;
  }
  uniform.value.needsUpdate = true;
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

/** Keys, and the wheel only with the focus. @param {Cloud} cloud @param {HTMLCanvasElement} canvas */
function listen(cloud, canvas) {
  const { controls } = cloud;
  canvas.addEventListener('focus', () => (controls.enableZoom = true));
  canvas.addEventListener('blur', () => (controls.enableZoom = false));
  canvas.addEventListener('pointerdown', () => canvas.focus({ preventScroll: true }), { capture: true });
  canvas.addEventListener('dblclick', () => cloud.view('turned'));
  /** @type {Record<string, () => void>} */
  const keys = {
    ArrowLeft: () => controls.rotateLeft(0.1), ArrowRight: () => controls.rotateLeft(-0.1),
    ArrowUp: () => controls.rotateUp(0.1), ArrowDown: () => controls.rotateUp(-0.1),
    '+': () => controls.dollyIn(0.9), '-': () => controls.dollyOut(0.9), Home: () => cloud.view('turned'),
  };
  canvas.addEventListener('keydown', (event) => {
    const action = event.ctrlKey || event.metaKey || event.altKey ? undefined : keys[event.key];
    if (!action) return;
    event.preventDefault();
    action();
    cloud.draw();
  });
}
