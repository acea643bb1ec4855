// A scan's surface: triangles with colours, lit from the viewer so that its shape shows. Colours, shape alone, or how exactly it is known.

import { RAMP } from './ramp.js';
import './vendor/three.js';
import { opaque, Viewer } from './viewer.js';

const { three } = globalThis;

/**
 * @typedef {object} Surface
 * @property {[number, number, number]} low - lowest corner, in the axes of the model, m
 * @property {number} step - of a coordinate, m
 * @property {Uint16Array} points - three coordinates each, in steps from `low`
 * @property {Uint32Array | Uint16Array} triangles - three numbers of points each, anticlockwise from outside
 * @property {Uint8Array} colours - red green blue each
 * @property {Uint8Array} noise - each: 0 exact .. 255 least exact
 * @property {Uint8Array} seen - each: 1 where a view measured it; 0 is hatched
 */

/** @typedef {'colour' | 'shape' | 'noise'} Paint */

/** Axes of a model: a camera's, X right Y down Z forward, or a mat's, Z up. @typedef {'camera' | 'mat'} Axes */

/** What lights it: the order is that of the shader's cases. @type {Paint[]} */
const PAINTS = ['colour', 'shape', 'noise'];

/** Nothing lies outside of it. */
const NOWHERE = { low: [-1e9, -1e9, -1e9], high: [1e9, 1e9, 1e9] };

/** Turn and tilt from which a thing on a mat is looked at first, rad. @type {[number, number]} */
const FROM_ABOVE = [0, 0.3];

/** Half of what a picture shows across or down, as a tangent; 0.5 would leave no margin. */
const FILLED = 0.46;

/** Points that decide from where all fits in. */
const LOOKED_AT = 3000;

const VERTEX = `
precision highp float;
in vec3 colour;
in float noise;
in float seen;
out vec3 tint;
out vec3 at;
out vec3 place;
out float share;
out float known;
void main() {
  vec4 eye = modelViewMatrix * vec4(position, 1.0);
  place = (modelMatrix * vec4(position, 1.0)).xyz;
  gl_Position = projectionMatrix * eye;
  at = eye.xyz;
  tint = colour;
  share = noise;
  known = seen;
}`;

const FRAGMENT = `
precision highp float;
uniform sampler2D ramp;
uniform int paint;
uniform vec3 low;
uniform vec3 high;
uniform float hatchPx;
in vec3 tint;
in vec3 at;
in vec3 place;
in float share;
in float known;
out vec4 shown;
void main() {
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  float facing = abs(dot(normal, normalize(at)));
  float light = paint == 0 ? 0.72 + 0.28 * facing : 0.25 + 0.75 * facing;
  vec3 own = paint == 0 ? tint : paint == 1 ? vec3(0.78) : texture(ramp, vec2(1.0 - share, 0.5)).rgb;
  bool isHatched = known < 0.5 && fract((gl_FragCoord.x + gl_FragCoord.y) / hatchPx) < 0.3;
  if (isHatched) own = mix(own, vec3(dot(own, vec3(0.3, 0.6, 0.1)) < 0.45 ? 1.0 : 0.0), 0.6);
  bool isOutside = any(lessThan(place, low)) || any(greaterThan(place, high));
  shown = vec4(own * light * (gl_FrontFacing ? 1.0 : 0.45) * (isOutside ? 0.3 : 1.0), 1.0);
}`;

/** From one line of the hatch to the next, along a row or a column of pixels, in CSS pixels. */
const HATCH_PX = 8;

/** What is higher above the mat than its paper and the noise of its depths stands on it, m; and so many points make a thing. */
const STANDS_M = 0.005;
const LEAST_STANDING = 20;

/**
 * The box around places.
 * @param {number[][]} places @param {number} share - of them that may lie beyond each side @param {number} margin - share of its sides
 * @returns {import('./crop_box.js').Box}
 */
function within(places, share, margin) {
  const ends = [0, 1, 2].map((axis) => {
    const values = places.map((place) => place[axis]).sort((a, b) => a - b);
    const [low, high] = [share, 1 - share].map((each) => values[Math.round(each * (values.length - 1))]);
    return [low - margin * (high - low), high + margin * (high - low)];
  });
  return { low: ends.map(([low]) => low), high: ends.map(([, high]) => high) };
}

/** A scan that can be turned. */
export class Model extends Viewer {
  /** @param {HTMLCanvasElement} canvas @param {HTMLCanvasElement} over @throws {Error} where there is no WebGL 2 */
  constructor(canvas, over) {
    super(canvas, over);
    const ramp = new three.DataTexture(opaque(RAMP), RAMP.length / 3, 1);
    ramp.magFilter = ramp.minFilter = three.LinearFilter;
    ramp.needsUpdate = true;
    const ends = { low: { value: new three.Vector3(...NOWHERE.low) }, high: { value: new three.Vector3(...NOWHERE.high) } };
    const hatchPx = { value: HATCH_PX * window.devicePixelRatio };
    const uniforms = { paint: { value: 0 }, ramp: { value: ramp }, hatchPx, ...ends };
    const shaders = { vertexShader: VERTEX, fragmentShader: FRAGMENT, glslVersion: three.GLSL3, uniforms, side: three.DoubleSide };
    this.material = new three.ShaderMaterial(shaders);
    /** @type {Map<string, three.Mesh>} parts of the surface, by their names */
    this.parts = new Map();
    /** @type {Map<string, Surface>} */
    this.surfaces = new Map();
  }

  /** Say which way the axes of all that is shown go. @param {Axes} axes */
  stands(axes) {
    this.legend.kind = axes;
  }

  /** A place of the model as one of a camera: X right, Y down, Z forward. @param {number[]} place @returns {number[]} */
  ofCamera([x, y, z]) {
    return this.legend.kind === 'mat' ? [x, -z, y] : [x, y, z];
  }

  /** All of a surface, seen whole. @param {Surface} surface */
  show(surface) {
    this.put('', surface);
    this.view('turned');
  }

  /** A part, in place of that of the same name; one without triangles only takes that away. @param {string} name @param {Surface} surface */
  put(name, surface) {
    const old = this.parts.get(name);
    if (old) {
      this.scene.remove(old);
      old.geometry.dispose();
      this.parts.delete(name);
      this.surfaces.delete(name);
    }
    this.draw();
    if (!surface.triangles.length) return;
    const geometry = new three.BufferGeometry();
    geometry.setIndex(new three.BufferAttribute(surface.triangles, 1));
    geometry.setAttribute('position', new three.BufferAttribute(surface.points, 3));
    geometry.setAttribute('colour', new three.BufferAttribute(surface.colours, 3, true));
    geometry.setAttribute('noise', new three.BufferAttribute(surface.noise, 1, true));
    geometry.setAttribute('seen', new three.BufferAttribute(surface.seen, 1));
    const mesh = new three.Mesh(geometry, this.material);
    mesh.frustumCulled = false;
    const [x, y, z] = this.ofCamera(surface.low);
    mesh.position.set(x, -y, -z);
    if (this.legend.kind === 'mat') {
      mesh.scale.setScalar(surface.step);
      mesh.rotation.x = -Math.PI / 2;
    } else mesh.scale.set(surface.step, -surface.step, -surface.step);
    this.scene.add(mesh);
    this.parts.set(name, mesh);
    this.surfaces.set(name, surface);
  }

  /** Take all parts away. */
  clear() {
    for (const mesh of this.parts.values()) {
      this.scene.remove(mesh);
      mesh.geometry.dispose();
    }
    this.parts.clear();
    this.surfaces.clear();
    this.renderer.clear();
    this.draw();
  }

  /** @param {Paint} paint */
  paint(paint) {
    this.material.uniforms.paint.value = PAINTS.indexOf(paint);
    this.draw();
  }

  /** Show what lies outside a box darker. @param {?import('./crop_box.js').Box} box - null: there is none */
  within(box) {
    const { low, high } = box ?? NOWHERE;
    const { uniforms } = this.material;
    const [a, b] = [this.ofCamera(low), this.ofCamera(high)];
    const ends = [0, 1, 2].map((axis) => [Math.min(a[axis], b[axis]), Math.max(a[axis], b[axis])]);
    uniforms.low.value.set(ends[0][0], -ends[1][1], -ends[2][1]);
    uniforms.high.value.set(ends[0][1], -ends[1][0], -ends[2][0]);
    this.draw();
  }

  /** Whether some of it is hatched. @returns {boolean} */
  hasUnseen() {
    return [...this.surfaces.values()].some(({ seen }) => seen.includes(0));
  }

  /** @returns {boolean} */
  isEmpty() {
    return !this.surfaces.size;
  }

  /** Some of its points, over all of it. @returns {number[][]} */
  some() {
    const all = [...this.surfaces.values()];
    const count = all.reduce((sum, { points }) => sum + points.length / 3, 0);
    const by = 3 * Math.max(1, Math.floor(count / LOOKED_AT));
    /** @type {number[][]} */
    const some = [];
    for (const { low, step, points } of all)
      for (let at = 0; at < points.length; at += by) some.push(low.map((value, axis) => value + step * points[at + axis]));
    return some;
  }

  /** The box in which most of it lies, or all that stands on a mat, for somebody to begin with. @returns {?import('./crop_box.js').Box} null: there is nothing */
  middle() {
    const some = this.some();
    if (!some.length) return null;
    const standing = this.legend.kind === 'mat' ? some.filter((place) => place[2] > STANDS_M) : [];
    if (standing.length < LEAST_STANDING) return within(some, 0.1, 0);
    const box = within(standing, 0.01, 0.05);
    return { low: [box.low[0], box.low[1], 0], high: box.high };
  }

  /** @returns {?import('./viewer.js').Stand} */
  stand() {
    const points = this.some().map((place) => this.ofCamera(place));
    if (!points.length) return null;
    const ends = [0, 1, 2].map((axis) => [Math.min(...points.map((place) => place[axis])), Math.max(...points.map((place) => place[axis]))]);
    const middle = ends.map(([least, most]) => (least + most) / 2);
    const scale = Math.hypot(...ends.map(([least, most]) => most - least));
    const stand = { middle, front: null, points, reach: /** @type {[number, number]} */ ([FILLED, FILLED]), scale };
    return this.legend.kind === 'mat' ? { ...stand, way: FROM_ABOVE, stray: 0 } : stand;
  }
}
