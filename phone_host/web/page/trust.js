// The answer that stands on top: can I trust my depth? With doubts in words and what to do about each.

import { byId, data, keep, make, say, sentence, show, text } from './dom.js';

/** @typedef {{problem: string, remedy: string}} Concern */
/** @typedef {{level: string, headline: string, concerns: Concern[]}} Trust */

const SIGNS = /** @type {Record<string, string>} */ ({ good: '\u2713', warning: '!', bad: '\u2715', unknown: '?' });

/** What is said before there is a run. @param {any} state @returns {Trust} */
export function before(state) {
  if (state.activity === 'running') return { level: 'unknown', headline: 'No pair has been processed yet', concerns: [] };
  const next = state.steps.find((/** @type {any} */ step) => !step.done);
  const todo = state.trouble ? 'Read what went wrong' : next ? `Next: ${next.words}` : state.steps.length ? 'Everything is set: start a run' : 'The run has ended';
  return { level: 'unknown', headline: `No depth yet. ${todo}`, concerns: [] };
}

/** @param {any} state */
export function showTrust(state) {
  /** @type {Trust} */
  const trust = state.live?.trust ?? before(state);
  const box = byId('trust');
  data(box, 'level', trust.level);
  text(byId('trust-sign'), SIGNS[trust.level] ?? '?');
  text(byId('headline'), sentence(trust.headline));
  say(`${trust.level === 'good' || trust.level === 'unknown' ? '' : `${trust.level}: `}${trust.headline}`);
  const list = byId('concerns');
  show(list, trust.concerns.length > 0);
  keep(list, trust.concerns, (one) => one.problem.replace(/\d+([.,]\d+)?/g, '#'), () => make('li', '', make('b'), ' ', make('span')), (item, one) => {
    text(item.children[0], sentence(one.problem));
    text(item.children[1], sentence(one.remedy));
  });
  const trouble = byId('trouble');
  show(trouble, !!state.trouble);
  if (state.trouble) text(trouble, `${sentence(state.trouble.problem)} ${sentence(state.trouble.remedy)}`);
}
