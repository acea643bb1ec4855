// One chart over time, by uPlot: the same on the live page and on static ones. A pointer or arrow keys read values, dragging or
// plus and minus zoom, a double click or Escape goes back, a name of the legend hides its line. The cursor is shared.

import './vendor/uplot.js';

const { uPlot } = globalThis;

/**
 * @typedef {(number | null)[]} Column
 * @typedef {{label: string, colour: string, mark?: 'area' | 'dots' | 'edge'}} Line  colour: a CSS variable; edge: of the band behind the others
 */

const HEIGHT_PX = 170;
const STEPS = 10;
const NONE = '\u2013';

/** A sum beyond this many times the 98th percentile would flatten all others: it is cut off and marked. */
const OUTLIER = 2.5;

/** Sums of each column with those before it; a row without any value is a gap. @param {Column[]} columns @returns {Column[]} */
export function stacked(columns) {
  const sums = new Array(columns[0]?.length ?? 0).fill(0);
  const gap = sums.map((_, k) => columns.every((column) => (column[k] ?? null) === null));
  return columns.map((column) => column.map((value, k) => (gap[k] ? null : (sums[k] += value ?? 0))));
}

/** @param {string} name */
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const axis = () => ({ stroke: colour('--ink2'), grid: { stroke: colour('--line'), width: 1 }, ticks: { stroke: colour('--line'), width: 1 }, font: '12px system-ui, sans-serif' });

/** @param {?number | undefined} value @param {string} unit @param {number} digits */
const shown = (value, unit, digits) => (value === null || value === undefined || Number.isNaN(value) ? NONE : `${value.toFixed(digits).replace(/^-(?=[0.]*$)/, '')} ${unit}`);

/** Values between two gaps, which no line shows. @param {Column} column @returns {?number[]} */
function alone(column) {
  const none = (/** @type {number} */ k) => (column[k] ?? null) === null;
  const found = column.flatMap((_, k) => (!none(k) && none(k - 1) && none(k + 1) ? [k] : []));
  return found.length ? found : null;
}

/** Made again when the colours change, otherwise only its data. */
export class Chart {
  /** @param {HTMLElement} place @param {string} unit @param {Line[]} lines - lowest first @param {boolean} isStacked */
  constructor(place, unit, lines, isStacked = false) {
    this.place = place;
    this.unit = unit;
    this.lines = lines;
    this.isStacked = isStacked;
    /** @type {any} */
    this.plot = null;
    /** @type {Column[]} times, s, then a column for each line */
    this.values = [[]];
    this.seen = true;
    place.tabIndex = 0;
    place.addEventListener('keydown', (event) => this.key(event));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.plot && this.make());
    new ResizeObserver(() => this.plot?.setSize({ width: place.clientWidth, height: HEIGHT_PX })).observe(place);
    new IntersectionObserver(([entry]) => ((this.seen = entry.isIntersecting), this.draw())).observe(place);
  }

  make() {
    this.plot?.destroy();
    const x = { ...axis(), values: (/** @type {any} */ _, /** @type {number[]} */ at) => at.map((s) => `${s} s`), size: 28, space: 70 };
    const y = { ...axis(), values: (/** @type {any} */ _, /** @type {number[]} */ at) => at.map((v, k) => (k === at.length - 1 ? `${v} ${this.unit}` : `${v}`)), size: 68, space: 32 };
    const time = { label: 'time', value: (/** @type {any} */ _, /** @type {number} */ s) => shown(s, 's', 1) };
    const lines = this.lines.map((line, k) => this.series(line, k));
    const edges = lines.flatMap((_, k) => (this.lines[k].mark === 'edge' ? [k + 1] : []));
    const options = {
      width: Math.max(100, this.place.clientWidth), height: HEIGHT_PX, series: [time, ...(this.isStacked ? lines.reverse() : lines)], axes: [x, y],
      scales: { x: { time: false }, y: { range: (/** @type {any} */ u, /** @type {?number} */ low, /** @type {?number} */ high) => this.range(u, low, high) } },
      bands: edges.length ? [{ series: edges, fill: `color-mix(in srgb, ${colour(this.lines[edges[0] - 1].colour)} 25%, transparent)` }] : [],
      cursor: { sync: { key: 'run' }, points: { size: 6 } }, legend: { live: true }, padding: [10, 8, 0, 0],
      hooks: { setSeries: [() => this.isStacked && this.renew()], draw: [() => this.isStacked && this.markCut()] },
    };
    this.plot = new uPlot(/** @type {any} */ (options), /** @type {any} */ (this.data()), this.place);
    for (const name of /** @type {NodeListOf<HTMLElement>} */ (this.place.querySelectorAll('.u-series ~ .u-series .u-label'))) {
      name.tabIndex = 0;
      name.setAttribute('role', 'button');
      name.title = 'hide or show';
    }
  }

  /** @param {Line} line @param {number} k */
  series({ label, colour: name, mark }, k) {
    const [hue, dots, edge] = [colour(name), mark === 'dots', mark === 'edge'];
    return {
      label, stroke: edge ? 'transparent' : hue, width: this.isStacked ? 0.5 : 1.5, fill: this.isStacked ? hue : undefined, class: edge ? 'u-edge' : undefined,
      ...(dots ? { paths: () => null } : {}), points: { show: dots, size: 4, fill: hue, filter: dots ? null : (/** @type {any} */ u, /** @type {number} */ at) => alone(u.data[at]) },
      value: (/** @type {any} */ _u, /** @type {any} */ _v, /** @type {number} */ _s, /** @type {?number} */ at) => shown(at === null ? null : this.values[k + 1][at], this.unit, 1),
    };
  }

  /** What is drawn: hidden layers add nothing. @returns {Column[]} */
  data() {
    if (!this.isStacked) return this.values;
    const count = this.lines.length;
    const layers = this.values.slice(1).map((column, k) => (this.plot?.series[count - k].show === false ? column.map(() => null) : column));
    return [this.values[0], ...stacked(layers).reverse()];
  }

  /** Zero is always there. @param {any} u @param {?number} low @param {?number} high @returns {[number, number]} */
  range(u, low, high) {
    let top = high ?? 1;
    if (this.isStacked) {
      const [from, to] = u.series[0].idxs;
      const sums = /** @type {Column} */ (u.data[1]).slice(from, to + 1).filter((sum) => sum !== null).sort((a, b) => Number(a) - Number(b));
      const usual = Number(sums[Math.floor(0.98 * (sums.length - 1))] ?? 0);
      if (top > OUTLIER * usual && usual > 0) top = 1.25 * usual;
    }
    return [Math.min(0, (low ?? 0) * 1.08), Math.max(low !== null && low < 0 ? 0 : 1, top * 1.08)];
  }

  /** A triangle stands where a sum is beyond the top. */
  markCut() {
    const { ctx, bbox, scales, data } = this.plot;
    const size = 4 * devicePixelRatio;
    ctx.fillStyle = colour('--ink');
    data[1].forEach((/** @type {?number} */ sum, /** @type {number} */ k) => {
      if (sum === null || sum <= scales.y.max || data[0][k] < scales.x.min || data[0][k] > scales.x.max) return;
      const x = this.plot.valToPos(data[0][k], 'x', true);
      ctx.beginPath();
      ctx.moveTo(x - size, bbox.top);
      ctx.lineTo(x, bbox.top - 1.75 * size);
      ctx.lineTo(x + size, bbox.top);
      ctx.fill();
    });
  }

  /** The same stretch of time, drawn again. */
  renew() {
    const { min, max } = this.plot.scales.x;
    this.plot.setData(this.data(), false);
    this.plot.setScale('x', { min, max });
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const plot = this.plot;
    const target = /** @type {HTMLElement} */ (event.target);
    if (!plot || event.ctrlKey || event.altKey || event.metaKey) return;
    if (target.matches('.u-label')) {
      if (event.key !== 'Enter' && event.key !== ' ') return;
      event.preventDefault();
      target.click();
      return;
    }
    const times = /** @type {number[]} */ (this.values[0]);
    const { min, max } = plot.scales.x;
    const last = times.length - 1;
    const at = plot.cursor.idx ?? plot.valToIdx((min + max) / 2);
    const by = event.shiftKey ? STEPS : 1;
    const to = { ArrowLeft: at - by, ArrowRight: at + by, Home: 0, End: last }[event.key];
    const zoom = { '+': 0.5, '-': 2 }[event.key];
    if (to !== undefined) {
      const k = Math.min(last, Math.max(0, to));
      const across = Math.min(max, Math.max(min, times[k])) - times[k];
      if (across) plot.setScale('x', { min: min - across, max: max - across });
      this.place.querySelector('.u-legend')?.setAttribute('aria-live', 'polite');
      plot.setCursor({ left: plot.valToPos(times[k], 'x'), top: 10 });
    } else if (zoom) {
      const half = (zoom * (max - min)) / 2;
      plot.setScale('x', { min: Math.max(times[0], times[at] - half), max: Math.min(times[last], times[at] + half) });
    } else if (event.key === 'Escape') plot.setScale('x', { min: times[0], max: times[last] });
    else return;
    event.preventDefault();
  }

  /** @param {Column[]} values - times, s, then a column for each line */
  set(values) {
    const [old] = this.values;
    this.values = values;
    const shown = this.plot?.scales.x;
    const isZoomed = shown && (shown.min > Number(old[0]) || shown.max < Number(old[old.length - 1])) && shown.max > Number(values[0][0]);
    this.draw(isZoomed);
  }

  /** @param {boolean} on */
  stack(on) {
    this.isStacked = on;
    if (this.plot) this.make();
  }

  /** @param {boolean} [isZoomed] - whether a part was chosen, which stays */
  draw(isZoomed = false) {
    if (this.values[0].length < 2) {
      this.plot?.destroy();
      this.plot = null;
      return;
    }
    if (!this.seen || !this.place.clientWidth) return;
    if (!this.plot) this.make();
    else if (isZoomed) this.renew();
    else this.plot.setData(this.data());
  }
}
