// The answer that stands on top: can I trust my depth? With doubts in words and what to do about each.

import { byId, data, keep, make, say, sentence, show, text } from './dom.js';

/** @typedef {{problem: string, remedy: string, doubt?: string}} Concern */
/** @typedef {{level: string, headline: string, concerns: Concern[]}} Trust */

const SIGNS = /** @type {Record<string, string>} */ ({ good: '\u2713', warning: '!', bad: '\u2715', unknown: '?' });

/** What is said before there is a run. @param {any} state @returns {Trust} */
export function before(state) {
  if (state.activity === 'running') return { level: 'unknown', headline: 'No pair has been processed yet', concerns: [] };
  const done = state.steps.map((/** @type {any} */ step) => step.done);
  // A step that was left out is not asked for again.
  const next = state.steps.slice(done.lastIndexOf(true) + 1).find((/** @type {any} */ step) => !step.done) ?? state.steps[done.indexOf(false)];
  const todo = state.trouble ? 'See what went wrong' : next ? `Next: ${next.words}` : state.steps.length ? 'Everything is set: start a run' : 'The run has ended';
  return { level: 'unknown', headline: `No depth yet. ${todo}`, concerns: [] };
}

/** What is said while something else than a run goes on: its pairs say nothing about depth. */
const DOING = /** @type {Record<string, string>} */ ({
  checking: 'Checking: the results appear below', calibrating: 'Calibrating: follow the instructions below',
});

/** The run whose doubts are shown, and how tall they have been in it, px: what comes and goes must not move the pictures. */
const seen = { begun: -1, width: 0, height: 0 };

/** What was said of the run that goes on, or of the last one. @param {any} state @returns {?Trust} */
function last(state) {
  const trust = state.live?.trust ?? null;
  const isOver = trust && state.steps?.length && state.activity === 'idle' && state.live.pairs > 0;
  return isOver ? { ...trust, level: trust.level === 'good' ? 'unknown' : trust.level, headline: `The last run: ${trust.headline}` } : trust;
}

/** What the headline does not say already; of a doubt that it names without a remedy, the remedy. @param {Trust} trust @returns {Concern[]} */
export function unsaid({ headline, concerns }) {
  const said = headline.toLowerCase();
  return concerns
    .map(({ problem, remedy, doubt }) => ({ problem: said.includes(problem.toLowerCase()) ? '' : problem, remedy, doubt }))
    .filter(({ problem, remedy, doubt }) => problem || doubt === 'age' || !said.includes(remedy.toLowerCase()));
}

/** Make a link to the chart of the delays, which is on the step of the run. @returns {HTMLAnchorElement} */
function delaysLink() {
  const link = make('a', '', 'See the delays');
  link.href = '#run';
  link.addEventListener('click', (event) => {
    event.preventDefault();
    const scroll = () => byId('title-delays').scrollIntoView({ block: 'start' });
    if (['run', ''].includes(document.body.dataset.step ?? '') || document.body.dataset.beside === 'yes') return scroll();
    window.addEventListener('hashchange', scroll, { once: true }); // after the listener that shows the step
    location.hash = 'run';
  });
  return link;
}

/** @param {HTMLElement} box @param {any} state */
function keepHeight(box, state) {
  const { width, height } = box.getBoundingClientRect();
  if (state.begun !== seen.begun || width !== seen.width || state.activity !== 'running') Object.assign(seen, { begun: state.begun, width, height: 0 });
  else seen.height = Math.max(seen.height, height);
  box.style.minHeight = seen.height ? `${seen.height}px` : '';
}

/** @param {any} state */
export function showTrust(state) {
  const doing = DOING[state.activity];
  /** @type {Trust} */
  const trust = doing ? { level: 'unknown', headline: doing, concerns: [] } : last(state) ?? before(state);
  const box = byId('trust');
  data(box, 'level', trust.level);
  text(byId('trust-sign'), SIGNS[trust.level] ?? '?');
  text(byId('headline'), sentence(trust.headline));
  say(`${trust.level === 'good' || trust.level === 'unknown' ? '' : `${trust.level}: `}${trust.headline}`);
  const list = byId('concerns');
  const others = unsaid(trust);
  show(list, others.length > 0);
  keep(list, others, (one) => `${one.doubt} ${one.problem.replace(/\d+([.,]\d+)?/g, '#')}`, (one) => make('li', '', make('b'), ' ', make('span'), ...(one.doubt === 'age' ? [' ', delaysLink()] : [])), (item, one) => {
    text(item.children[0], sentence(one.problem));
    text(item.children[1], sentence(one.remedy));
  });
  keepHeight(box, state);
  const trouble = byId('trouble');
  const wrong = state.trouble ?? state.live?.unsaved;
  show(trouble, !!wrong);
  if (wrong) text(trouble, `${sentence(wrong.problem)} ${sentence(wrong.remedy)}`);
}
