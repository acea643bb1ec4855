// The way from nothing to a run and a scan: which step is shown, and what is done. The address's fragment names the step, so that back and reload work.

import { byId, data, sentence, show, text } from './dom.js';

export const STEPS = /** @type {const} */ (['board', 'camera', 'check', 'calibration', 'run', 'scan']);

/** The step to show: the one asked for, else the run if there is one, else the first that is not done. @param {any} state @param {string} asked */
export function stepOf(state, asked) {
  if (state.steps.some((/** @type {any} */ step) => step.name === asked)) return asked;
  if (state.activity === 'running' || state.activity === 'ending') return 'run';
  if (state.activity === 'calibrating') return 'calibration';
  if (state.activity === 'scanning') return 'scan';
  const open = state.steps.find((/** @type {any} */ step) => !step.done)?.name ?? 'run';
  return open === 'scan' ? 'run' : open; // nobody has to scan
}

/** @param {any} state @param {string} shown */
export function showSteps(state, shown) {
  const names = state.steps.map((/** @type {any} */ step) => step.name);
  for (const name of STEPS) {
    const link = byId(`step-${name}`);
    const step = state.steps.find((/** @type {any} */ each) => each.name === name);
    show(/** @type {HTMLElement} */ (link.parentElement), !!step);
    data(link, 'done', step?.done ? 'yes' : 'no');
    if (name === shown) link.setAttribute('aria-current', 'step');
    else link.removeAttribute('aria-current');
    text(link.children[0], step?.done ? '\u2713' : String(names.indexOf(name) + 1));
    text(link.children[1], step?.done ? ', done' : '');
    show(byId(`panel-${name}`), name === shown);
    const words = document.querySelector(`#panel-${name} .words`);
    if (words && step) text(words, sentence(step.words));
  }
  data(document.body, 'step', shown);
  data(document.body, 'beside', names.length ? 'no' : 'yes');
  const next = names[names.indexOf(shown) + 1];
  for (const link of /** @type {NodeListOf<HTMLAnchorElement>} */ (document.querySelectorAll('a.next'))) {
    show(link, !!next && !!state.steps.find((/** @type {any} */ step) => step.name === shown)?.done);
    link.href = `#${next}`;
    text(link, `Next: ${next}`);
  }
}
