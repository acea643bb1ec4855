// A scan's surface: triangles with colours, lit from the viewer so that its shape shows. Colours, shape alone, or how exactly it is known.

import { RAMP } from './ramp.js';
import * as three from './vendor/three.js';
import { opaque, Viewer } from './viewer.js';

/**
 * @typedef {object} Surface
 * @property {[number, number, number]} low - lowest corner, X right Y down Z forward, m
 * @property {number} step - of a coordinate, m
 * @property {number[]} size - along the axes, m
 * @property {Uint16Array} points - three coordinates each, in steps from `low`
 * @property {Uint32Array} triangles - three numbers of points each, anticlockwise from outside
 * @property {Uint8Array} colours - red green blue each
 * @property {Uint8Array} noise - each: 0 exact .. 255 least exact
 */

/** @typedef {'colour' | 'shape' | 'noise'} Paint */

/** What lights it: the order is that of the shader's cases. @type {Paint[]} */
const PAINTS = ['colour', 'shape', 'noise'];

/** Points that decide from where all fits in. */
const LOOKED_AT = 3000;

const VERTEX = `
precision highp float;
in vec3 colour;
in float noise;
uniform vec3 low;
uniform float size;
out vec3 tint;
out vec3 at;
out float share;
void main() {
  vec3 place = low + position * size;
  vec4 seen = modelViewMatrix * vec4(place.x, -place.y, -place.z, 1.0);
  gl_Position = projectionMatrix * seen;
  at = seen.xyz;
  tint = colour;
  share = noise;
}`;

const FRAGMENT = `
precision highp float;
uniform sampler2D ramp;
uniform int paint;
in vec3 tint;
in vec3 at;
in float share;
out vec4 shown;
void main() {
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  float facing = abs(dot(normal, normalize(at)));
  float light = paint == 0 ? 0.72 + 0.28 * facing : 0.25 + 0.75 * facing;
  vec3 own = paint == 0 ? tint : paint == 1 ? vec3(0.78) : texture(ramp, vec2(1.0 - share, 0.5)).rgb;
  shown = vec4(own * light * (gl_FrontFacing ? 1.0 : 0.45), 1.0);
}`;

/** A scan that can be turned. */
export class Model extends Viewer {
  /** @param {HTMLCanvasElement} canvas @param {HTMLCanvasElement} over @throws {Error} where there is no WebGL 2 */
  constructor(canvas, over) {
    super(canvas, over);
    const ramp = new three.DataTexture(opaque(RAMP), RAMP.length / 3, 1);
    ramp.magFilter = ramp.minFilter = three.LinearFilter;
    ramp.needsUpdate = true;
    const uniforms = { low: { value: [0, 0, 0] }, size: { value: 1 }, paint: { value: 0 }, ramp: { value: ramp } };
    const shaders = { vertexShader: VERTEX, fragmentShader: FRAGMENT, glslVersion: three.GLSL3, uniforms, side: three.DoubleSide };
    this.material = new three.ShaderMaterial(shaders);
    /** @type {?Surface} */
    this.surface = null;
  }

  /** @param {Surface} surface */
  show(surface) {
    const geometry = new three.BufferGeometry();
    geometry.setIndex(new three.BufferAttribute(surface.triangles, 1));
    geometry.setAttribute('position', new three.BufferAttribute(surface.points, 3));
    geometry.setAttribute('colour', new three.BufferAttribute(surface.colours, 3, true));
    geometry.setAttribute('noise', new three.BufferAttribute(surface.noise, 1, true));
    this.material.uniforms.low.value = surface.low;
    this.material.uniforms.size.value = surface.step;
    const mesh = new three.Mesh(geometry, this.material);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
    this.surface = surface;
    this.view('turned');
  }

  /** @param {Paint} paint */
  paint(paint) {
    this.material.uniforms.paint.value = PAINTS.indexOf(paint);
    this.draw();
  }

  /** @returns {boolean} */
  isEmpty() {
    return !this.surface;
  }

  /** @returns {?import('./viewer.js').Stand} */
  stand() {
    if (!this.surface) return null;
    const { low, step, size, points } = this.surface;
    const by = 3 * Math.max(1, Math.floor(points.length / 3 / LOOKED_AT));
    const some = [];
    for (let at = 0; at < points.length; at += by) some.push(low.map((value, axis) => value + step * points[at + axis]));
    const middle = low.map((value, axis) => value + size[axis] / 2);
    return { middle, front: null, points: some, reach: [0.5, 0.5], scale: Math.hypot(...size) };
  }
}
