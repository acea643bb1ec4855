// Charts of a run, by uPlot: delays stacked in the order in which they happen, pairs per second, time skew. The cursor is shared.

import uPlot from './vendor/uplot.js';

/** @typedef {number[]} Sample  done_s, capture, outbox, propagation, pairing, queuing, processing, end to end, skew; ms */

const KEPT = 600;
const PARTS = ['capture', 'outbox', 'propagation', 'pairing', 'queuing', 'processing'];
const COLOURS = ['--c0', '--c6', '--c5', '--c3', '--c4', '--c2'];
const HEIGHT_PX = 170;
const RATE_S = 2;

/** Pairs per second at each sample, over the last two seconds. @param {number[]} done - s, rising @returns {(number | null)[]} */
export function rates(done) {
  let first = 0;
  return done.map((now, k) => {
    while (done[first] < now - RATE_S) first++;
    return k - first < 2 ? null : (k - first) / (now - done[first]);
  });
}

/** Sums of each column with those before it. @param {(number | null)[][]} columns @returns {(number | null)[][]} */
export function stacked(columns) {
  const sums = new Array(columns[0]?.length ?? 0).fill(0);
  return columns.map((column) => column.map((value, k) => (sums[k] += value ?? 0)));
}

/** @param {string} name */
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const axis = () => ({ stroke: colour('--ink2'), grid: { stroke: colour('--line'), width: 1 }, ticks: { stroke: colour('--line'), width: 1 }, font: '12px system-ui, sans-serif' });

/** @param {(number | null)} value @param {string} unit */
const shown = (value, unit) => (value === null || value === undefined || Number.isNaN(value) ? '\u2013' : `${value.toFixed(1)} ${unit}`);

/** One chart: made again when the colours change, otherwise only its data. */
class Chart {
  /** @param {HTMLElement} place @param {string} unit @param {() => any[]} series */
  constructor(place, unit, series) {
    this.place = place;
    this.unit = unit;
    this.series = series;
    /** @type {any} */
    this.plot = null;
    /** @type {any} */
    this.values = [[]];
    this.seen = true;
    new ResizeObserver(() => this.plot?.setSize({ width: this.place.clientWidth, height: HEIGHT_PX })).observe(place);
    new IntersectionObserver(([entry]) => ((this.seen = entry.isIntersecting), this.draw())).observe(place);
  }

  make() {
    this.plot?.destroy();
    const x = { ...axis(), values: (/** @type {any} */ _, /** @type {number[]} */ at) => at.map((s) => `${s} s`), size: 28, space: 70 };
    const y = { ...axis(), size: 44, space: 32, label: undefined };
    const series = [{ label: 'time', value: (/** @type {any} */ _, /** @type {number} */ s) => (s === null || s === undefined ? '\u2013' : `${s.toFixed(1)} s`) }, ...this.series()];
    const options = {
      width: Math.max(100, this.place.clientWidth), height: HEIGHT_PX, series, axes: [x, y], scales: { x: { time: false }, y: { range: fromZero } },
      cursor: { sync: { key: 'run' }, points: { size: 6 } }, legend: { live: true }, padding: [10, 8, 0, 0],
    };
    this.plot = new uPlot(/** @type {any} */ (options), this.values, this.place);
  }

  /** @param {any} values */
  set(values) {
    this.values = values;
    this.draw();
  }

  draw() {
    if (!this.seen || !this.place.clientWidth || this.values[0].length < 2) return;
    if (this.plot) this.plot.setData(this.values);
    else this.make();
  }
}

/** @type {any} */
const fromZero = (/** @type {any} */ _, /** @type {?number} */ low, /** @type {?number} */ high) => [Math.min(0, low ?? 0), Math.max(1, (high ?? 1) * 1.08)];

export class Charts {
  /** @param {{delays: HTMLElement, rate: HTMLElement, skew: HTMLElement}} places */
  constructor(places) {
    /** @type {Sample[]} */
    this.samples = [];
    this.isStacked = true;
    this.start = 0;
    this.delays = new Chart(places.delays, 'ms', () => this.delaySeries());
    const one = (/** @type {string} */ label, /** @type {string} */ hue, /** @type {string} */ unit) => () => [
      { label, stroke: colour(hue), width: 1.5, points: { show: false }, value: (/** @type {any} */ _, /** @type {?number} */ v) => shown(v, unit) },
    ];
    this.rate = new Chart(places.rate, '1/s', one('pairs per second', '--c5', '/s'));
    this.skew = new Chart(places.skew, 'ms', one('time skew', '--c3', 'ms'));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.remake());
  }

  delaySeries() {
    return PARTS.map((label, k) => ({
      label, stroke: colour(COLOURS[k]), width: this.isStacked ? 0.5 : 1.5, points: { show: false },
      fill: this.isStacked ? colour(COLOURS[k]) : undefined,
      value: (/** @type {any} */ _u, /** @type {any} */ _v, /** @type {number} */ _s, /** @type {?number} */ at) => shown(at === null ? null : this.samples[at]?.[k + 1], 'ms'),
    })).reverse();
  }

  remake() {
    for (const chart of [this.delays, this.rate, this.skew]) if (chart.plot) chart.make();
  }

  /** @param {boolean} on */
  stack(on) {
    this.isStacked = on;
    this.draw();
    if (this.delays.plot) this.delays.make();
  }

  /** @param {Sample[]} samples - new ones */
  add(samples) {
    if (!samples.length) return;
    // A run that starts over starts its time over.
    if (!this.samples.length || samples[0][0] < this.samples[this.samples.length - 1][0]) {
      this.samples = [];
      this.start = samples[0][0];
    }
    this.samples = [...this.samples, ...samples].slice(-KEPT);
    this.draw();
  }

  draw() {
    const column = (/** @type {number} */ k) => this.samples.map((sample) => sample[k] ?? null);
    const done = this.samples.map((sample) => sample[0] - this.start);
    const parts = PARTS.map((_, k) => column(k + 1));
    this.delays.set([done, ...(this.isStacked ? stacked(parts) : parts).reverse()]);
    this.rate.set([done, rates(done)]);
    this.skew.set([done, column(8)]);
  }
}
