// Distances and lengths: a tap on the depth or the left picture, two taps. The page's own value is there at once; the program then
// measures the same pair with its full precision and the rig's uncertainty.

import { post } from './connection.js';
import { cellAt, depthOf, lengthOf, millimetres, placeOf, sigmaOf } from './depth.js';
import { say, text } from './dom.js';
import { put } from './pointing.js';

/** @typedef {import('./message.js').Pair} Pair */
/** @typedef {import('./pointing.js').Spot} Spot */

const HINT = 'Tap the picture: distance. Tap twice: a length.';

/** What a place is, from the page's own data. @param {Pair} pair @param {Spot} at @returns {string} */
export function hoverWords(pair, at) {
  const { grid, head } = pair;
  if (!grid) return head.range ? HINT : 'no depth in this run';
  const { d } = cellAt(grid, at.x, at.y);
  if (Number.isNaN(d)) return 'no depth here';
  if (!head.geometry) return `${d.toFixed(2)} px disparity; metres need a calibration`;
  const z = depthOf(head.geometry, d);
  return `${millimetres(z, sigmaOf(head.geometry, z))} deep`;
}

/** The same for taps. @param {Pair} pair @param {Spot[]} spots @returns {string} */
export function localWords(pair, spots) {
  const { grid, head } = pair;
  const { geometry } = head;
  if (!grid || !geometry) return hoverWords(pair, spots[spots.length - 1]);
  const places = spots.map((at) => placeOf(geometry, at.x, at.y, depthOf(geometry, cellAt(grid, at.x, at.y).d)));
  if (places.some((place) => Number.isNaN(place[2]))) return 'no depth there';
  if (places.length === 1) {
    const away = lengthOf(places[0]);
    return `distance ${millimetres(away, (sigmaOf(geometry, places[0][2]) * away) / places[0][2])}`;
  }
  return `length ${millimetres(lengthOf(places[0].map((v, k) => v - places[1][k])), null)}`;
}

/**
 * The program's answer in words.
 * @param {any} measured - Measured as JSON @param {number} count - of points
 * @returns {string}
 */
export function measuredWords(measured, count) {
  if (measured.problem) return `${measured.problem}: ${measured.remedy}`;
  if (count === 2 && measured.length_m !== null) return `length ${millimetres(measured.length_m, measured.length_sigma_m)}`;
  if (count === 1 && measured.distances_m?.[0] != null) return `distance ${millimetres(measured.distances_m[0], measured.place_sigmas_m[0])}`;
  return measured.words || 'no depth there';
}

export class Measure {
  /** @param {HTMLElement} readout @param {HTMLElement[]} frames - pictures of the left image, each with two `.spot` marks and a `.span` line */
  constructor(readout, frames) {
    this.readout = readout;
    this.frames = frames;
    /** @type {Spot[]} */
    this.spots = [];
    this.asked = 0;
    /** Whether the next tap begins anew: a length is whole, or a place has no depth. */
    this.isOver = false;
    this.clear();
  }

  clear() {
    this.spots = [];
    this.asked++;
    text(this.readout, HINT);
    this.readout.dataset.from = 'hint';
    this.mark({ width: 1, height: 1 });
  }

  /** @param {?Pair} pair @param {Spot} at */
  hover(pair, at) {
    if (this.spots.length || !pair) return;
    text(this.readout, hoverWords(pair, at));
    this.readout.dataset.from = 'page';
  }

  /** @param {?Pair} pair @param {Spot} at */
  async tap(pair, at) {
    if (!pair) return;
    this.spots = this.isOver || this.spots.length === 2 ? [{ ...at }] : [...this.spots, { ...at }];
    this.isOver = false;
    this.mark(pair.head);
    const asked = ++this.asked;
    const count = this.spots.length;
    text(this.readout, localWords(pair, this.spots));
    this.readout.dataset.from = 'page';
    const measured = await post('/api/measure', { points: this.spots.map(({ x, y }) => [x, y]), number: pair.head.number });
    if (asked !== this.asked) return;
    if (!measured.problem) {
      // Pictures go on; the marks and the value belong to this pair.
      text(this.readout, `${measuredWords(measured, count)} (pair ${pair.head.number})`);
      this.readout.dataset.from = 'program';
      this.isOver = count === 2 || measured.distances_m?.[0] == null;
    }
    say(this.readout.textContent ?? '');
  }

  /** @param {{width: number, height: number}} size */
  mark(size) {
    for (const frame of this.frames) {
      const spots = /** @type {NodeListOf<HTMLElement>} */ (frame.querySelectorAll('.spot'));
      spots.forEach((mark, k) => {
        mark.hidden = k >= this.spots.length;
        if (!mark.hidden) put(mark, this.spots[k], size);
      });
      span(/** @type {HTMLElement} */ (frame.querySelector('.span')), this.spots, size, frame);
    }
  }
}

/** The line between two spots. @param {HTMLElement} line @param {Spot[]} spots @param {{width: number, height: number}} size @param {HTMLElement} frame */
function span(line, spots, size, frame) {
  line.hidden = spots.length < 2;
  if (line.hidden) return;
  put(line, spots[0], size);
  const [dx, dy] = [((spots[1].x - spots[0].x) / size.width) * frame.clientWidth, ((spots[1].y - spots[0].y) / size.height) * frame.clientHeight];
  line.style.width = `${Math.hypot(dx, dy)}px`;
  line.style.transform = `rotate(${Math.atan2(dy, dx)}rad)`;
}
