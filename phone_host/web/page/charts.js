// Charts of a run: delays stacked in the order in which they happen, pairs per second, time skew.

import { Chart } from './chart.js';

/** @typedef {number[]} Sample  done_s, capture, outbox, propagation, pairing, queuing, processing, end to end, skew; ms */

const KEPT = 600;
const PARTS = ['capture', 'outbox', 'propagation', 'pairing', 'queuing', 'processing'];
const COLOURS = ['--c0', '--c6', '--c5', '--c3', '--c4', '--c2'];
const RATE_S = 2;

/** Pairs per second at each sample, over the last two seconds. @param {number[]} done - s, rising @returns {(number | null)[]} */
export function rates(done) {
  let first = 0;
  return done.map((now, k) => {
    while (done[first] < now - RATE_S) first++;
    return k - first < 2 ? null : (k - first) / (now - done[first]);
  });
}

export class Charts {
  /** @param {{delays: HTMLElement, rate: HTMLElement, skew: HTMLElement}} places */
  constructor(places) {
    /** @type {Sample[]} */
    this.samples = [];
    this.start = 0;
    this.delays = new Chart(places.delays, 'ms', PARTS.map((label, k) => ({ label, colour: COLOURS[k] })), true);
    this.rate = new Chart(places.rate, '/s', [{ label: 'pairs per second', colour: '--c5' }]);
    this.skew = new Chart(places.skew, 'ms', [{ label: 'time skew', colour: '--c3' }]);
  }

  /** @param {boolean} on */
  stack(on) {
    this.delays.stack(on);
  }

  /** @param {Sample[]} samples - new ones */
  add(samples) {
    if (!samples.length) return;
    // A connection that comes back brings samples again.
    if (!this.samples.length || samples[0][0] < this.samples[this.samples.length - 1][0]) {
      this.samples = [];
      this.start = samples[0][0];
    }
    this.samples = [...this.samples, ...samples].slice(-KEPT);
    this.draw();
  }

  /** Delay of the newest pair of this run, ms. @returns {?number} */
  delay() {
    return this.samples[this.samples.length - 1]?.[7] ?? null;
  }

  /** A run begins: nothing of the one before stays. */
  clear() {
    this.samples = [];
    this.draw();
  }

  draw() {
    const column = (/** @type {number} */ k) => this.samples.map((sample) => sample[k] ?? null);
    const done = this.samples.map((sample) => sample[0] - this.start);
    this.delays.set([done, ...PARTS.map((_, k) => column(k + 1))]);
    this.rate.set([done, rates(done)]);
    this.skew.set([done, column(8)]);
  }
}
