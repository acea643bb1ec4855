// The scale bar and the axes over a cloud, on a canvas of their own.

import './vendor/three.js';

const { Vector3 } = globalThis.three;

/** Ways of the axes inside the viewer: a camera's, and those of what stands on a mat, whose Z points up. */
const WAYS = { camera: [[1, 0, 0], [0, -1, 0], [0, 0, -1]], mat: [[1, 0, 0], [0, 0, -1], [0, 1, 0]] };
const AXES = /** @type {const} */ ([['X', '#e0452f'], ['Y', '#2f9e44'], ['Z', '#3b82f6']]);
const LONGEST_PX = 130;

/** A round length. @param {number} most - m @returns {number} the longest of 1, 2, 5 times a power of ten that is not longer */
export function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * (most / power >= 5 ? 5 : most / power >= 2 ? 2 : 1);
}

/** @param {number} length - m @returns {string} */
export const lengthWords = (length) =>
  length >= 1 ? `${length} m` : length >= 0.01 ? `${Math.round(length * 100)} cm` : `${Number((length * 1000).toPrecision(2))} mm`;

export class CloudLegend {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    /** @type {'camera' | 'mat'} */
    this.kind = 'camera';
  }

  /**
   * @param {any} camera
   * @param {Vector3} target - where the scale holds
   * @param {number} zoom - px of the page per unit of tangent @param {number} ratio - device pixels per px
   */
  draw(camera, target, zoom, ratio) {
    const { canvas, pen } = this;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio);
      canvas.height = Math.round(h * ratio);
    }
    const style = getComputedStyle(canvas);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    pen.font = '12px system-ui, sans-serif';
    pen.lineJoin = pen.lineCap = 'round';
    pen.textBaseline = 'middle';
    this.edge = style.getPropertyValue('--ground') || style.backgroundColor;
    this.bar(camera.position.distanceTo(target), zoom, h, style.color);
    this.axes(camera, w, h);
  }

  /** Show nothing. */
  clear() {
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  /** @param {number} away - m @param {number} zoom @param {number} h @param {string} ink */
  bar(away, zoom, h, ink) {
    const length = roundLength((LONGEST_PX * away) / zoom);
    const [x, y, end] = [14, h - 14, 14 + (zoom * length) / away];
    this.line([[x, y - 4], [x, y], [end, y], [end, y - 4]], ink);
    this.pen.textAlign = 'left';
    this.words(lengthWords(length), end + 7, y - 1, ink);
  }

  /** @param {any} camera @param {number} w @param {number} h */
  axes(camera, w, h) {
    const [x, y] = [w - 42, h - 40];
    this.pen.textAlign = 'center';
    for (const [axis, [name, hue]] of AXES.entries()) {
      const [wx, wy, wz] = WAYS[this.kind][axis];
      const seen = new Vector3(wx, wy, wz).transformDirection(camera.matrixWorldInverse);
      this.line([[x, y], [x + 24 * seen.x, y - 24 * seen.y]], hue);
      this.words(name, x + 33 * seen.x, y - 33 * seen.y, hue);
    }
  }

  /** Lines and letters have an edge in the colour of the ground, so that they can be read over points. @param {number[][]} path @param {string} hue */
  line(path, hue) {
    const { pen } = this;
    pen.beginPath();
    path.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    for (const [colour, width] of /** @type {[string, number][]} */ ([[this.edge, 5], [hue, 2]])) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.stroke();
    }
  }

  /** @param {number} x @param {number} y @param {number} radius - px @param {string} hue */
  dot(x, y, radius, hue) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fillStyle = hue;
    pen.fill();
    pen.strokeStyle = /** @type {string} */ (this.edge);
    pen.lineWidth = 2;
    pen.stroke();
  }

  /** @param {string} text @param {number} x @param {number} y @param {string} hue */
  words(text, x, y, hue) {
    const { pen } = this;
    pen.strokeStyle = /** @type {string} */ (this.edge);
    pen.lineWidth = 4;
    pen.strokeText(text, x, y);
    pen.fillStyle = hue;
    pen.fillText(text, x, y);
  }
}
