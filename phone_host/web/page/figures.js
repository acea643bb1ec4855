// The run in figures: rate, density, delay, skew, link, clock; what was dropped and why. Values keep their width.

import { byId, data, keep, make, show, text } from './dom.js';

const NO = '\u2013';

/** @param {?number | undefined} value @param {number} n - digits after the point */
const number = (value, n) => (value === null || value === undefined || Number.isNaN(value) ? NO : value.toFixed(n));

/** @typedef {{name: string, value: string, unit: string, note: string, level?: string}} Figure */

/** @param {?number} us @returns {string} */
const uncertainty = (us) => (us === null || us === undefined ? NO : us < 1000 ? `\u00b1 ${us.toFixed(0)} \u00b5s` : `\u00b1 ${(us / 1000).toFixed(1)} ms`);

/** @param {any} live @param {?number} delay - of the newest pair, ms @returns {Figure[]} */
export function figuresOf(live, delay) {
  const { clock, link } = live;
  return [
    { name: 'pairs', value: number(live.pairs_per_s, 1), unit: '/s', note: `${live.pairs} in all` },
    { name: 'density', value: number(live.density === null ? null : 100 * live.density, 0), unit: '%', note: live.cropped ? 'of the crop' : 'have depth' },
    { name: 'delay', value: number(delay, 0), unit: 'ms', note: 'light to depth' },
    { name: 'time skew', value: number(live.time_skew_ms, 1), unit: 'ms', note: 'of exposures' },
    { name: 'link', value: link.up ? 'up' : 'down', unit: '', note: link.name, level: link.up ? 'good' : 'bad' },
    { name: 'clock', value: clock.known ? 'known' : 'waiting', unit: '', note: clock.known ? uncertainty(clock.uncertainty_us) : 'of the board', level: clock.known ? 'good' : 'warning' },
  ];
}

/** @param {any} live @param {?number} delay - of the newest pair, ms */
export function showFigures(live, delay) {
  show(byId('figures'), !!live);
  show(byId('drops-box'), !!live);
  if (!live) return;
  keep(
    byId('figures'), figuresOf(live, delay), (one) => one.name,
    () => make('div', '', make('dt'), make('dd', '', make('span', 'value'), make('small')), make('dd', 'note')),
    (item, one) => {
      const [name, value, note] = /** @type {HTMLElement[]} */ ([...item.children]);
      text(name, one.name);
      text(value.children[0], one.value);
      text(value.children[1], one.unit);
      text(note, one.note);
      data(value, 'level', one.level ?? '');
    },
  );
  text(byId('cut'), live.cut ? `Black: ${live.cut}` : '');
  const drops = Object.entries(live.drops).filter(([, count]) => Number(count) > 0);
  show(byId('drops-none'), drops.length === 0);
  keep(byId('drops'), drops, ([reason]) => reason, () => make('div', '', make('dt'), make('dd')), (item, [reason, count]) => {
    text(item.children[0], reason);
    text(item.children[1], String(count));
  });
}
