// The point cloud: disparity and colours are textures, the vertex shader reprojects. The live page loads this module, the static pages
// hold it inlined.
//
// There are no vertex buffers: a point's number is gl_VertexID.

import { lengthOf, middleOf, places } from './depth.js';
import { RAMP } from './ramp.js';
import './vendor/three.js';
import { opaque, Viewer } from './viewer.js';

const { three } = globalThis;

/** @typedef {import('./depth.js').Grid} Grid */
/** @typedef {import('./depth.js').Geometry} Geometry */
/** @typedef {import('./depth.js').Limits} Limits */

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

export { canShowClouds } from './viewer.js';

/** A cloud that can be turned. */
export class Cloud extends Viewer {
  /**
   * @param {HTMLCanvasElement} canvas - takes the keyboard, too
   * @param {HTMLCanvasElement} over - lies on it, for scale and axes
   * @throws {Error} where there is no WebGL 2
   */
  constructor(canvas, over) {
    super(canvas, over);
    this.material = shaders();
    this.points = new three.Points(new three.BufferGeometry(), this.material);
    this.points.frustumCulled = false;
    this.points.visible = false;
    this.scene.add(this.points);
    /** @type {?{grid: Grid, geometry: Geometry, limits: Limits}} */
    this.data = null;
    this.thin = 1;
    this.lastMove = 0;
    this.slow = 0;
    this.rest = 0;
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
    if (!this.pivot && middleOf(grid, geometry, limits)) this.view('turned');
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

  /** @returns {boolean} */
  isEmpty() {
    return !this.data;
  }

  /** @returns {?import('./viewer.js').Stand} */
  stand() {
    if (!this.data) return null;
    const { grid, geometry, limits } = this.data;
    const middle = middleOf(grid, geometry, limits) ?? this.pivot ?? [0, 0, 1];
    const points = places(grid, geometry, limits);
    const { focal } = geometry;
    return { middle, front: lengthOf(middle), points, reach: [grid.width / 2 / focal, grid.height / 2 / focal], scale: middle[2] };
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

  /** What the left camera sees fits in: the same angle across the tighter side. @param {number} w @param {number} h @returns {number} */
  zoom(w, h) {
    const { grid, geometry } = /** @type {{grid: Grid, geometry: Geometry}} */ (this.data);
    return Math.min(w / grid.width, h / grid.height) * geometry.focal;
  }

  /** @param {number} pixels - device pixels per unit of tangent */
  ready(pixels) {
    const { grid } = /** @type {{grid: Grid}} */ (this.data);
    const { uniforms } = this.material;
    uniforms.thin.value = this.thin;
    uniforms.pixels.value = pixels;
    const count = Math.ceil(grid.columns / this.thin) * Math.ceil(grid.rows / this.thin);
    this.points.geometry.setDrawRange(0, count);
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
