// Holds the camera's settings, group by group: automatic for a while, read, held, read back, and looked at again every few seconds.

import { capabilitiesOf } from './camera_track.js';

/** @typedef {'focus' | 'exposure' | 'white_balance' | 'zoom' | 'torch'} Group */
/** @typedef {Record<string, any>} Values - by their names in MediaTrackConstraints */
/** @typedef {Partial<Record<Group, ?Values>>} Groups - values: hold these; {}: what is found; null: automatic */
/** @typedef {{asked: Values, got: Values}} Held */

/** Of each group: its switch between automatic and manual, if it has one, and its values. */
export const GROUPS = /** @type {Record<Group, {mode: string, values: string[]}>} */ ({
  focus: { mode: 'focusMode', values: ['focusDistance'] },
  exposure: { mode: 'exposureMode', values: ['exposureTime', 'iso'] },
  white_balance: { mode: 'whiteBalanceMode', values: ['colorTemperature'] },
  zoom: { mode: '', values: ['zoom'] },
  torch: { mode: '', values: ['torch'] },
});
export const NAMES = /** @type {Group[]} */ (Object.keys(GROUPS));

const SETTLE_MS = 2000;
const VERIFY_MS = 5000;
/** Cameras round: what is held may differ from what was asked by so much, beside a step. */
const ROUNDING = 0.02;

/** @param {Values} capabilities @param {Group} group @returns {boolean} whether the camera can hold it */
export function canHold(capabilities, group) {
  const { mode, values } = GROUPS[group];
  return mode ? !!capabilities[mode]?.includes('manual') : group === 'torch' ? !!capabilities.torch : values[0] in capabilities;
}

/** @param {any} asked @param {any} got @param {number} step */
const isSame = (asked, got, step) => (typeof asked === 'number' ? Math.abs(asked - got) <= Math.max(step, ROUNDING * Math.abs(asked), 1e-6) : asked === got);

export class Locks {
  /**
   * @param {MediaStreamTrack} track @param {MediaTrackConstraints} base - with which it was opened: each call replaces them all
   * @param {(isDone: boolean) => void} told - after each change; not done: groups find their values now
   */
  constructor(track, base, told) {
    this.track = track;
    this.base = base;
    this.told = told;
    this.capabilities = capabilitiesOf(track);
    /** @type {Partial<Record<Group, Values>>} the constraints of each group now */
    this.sets = {};
    /** @type {Partial<Record<Group, Held>>} */
    this.held = {};
    /** @type {Partial<Record<Group, string>>} why a group is not as it was wanted last */
    this.refused = {};
    /** @type {Groups} what was wanted last: a later wish overtakes one that still waits for its values */
    this.wishes = {};
    /** @type {Set<Group>} groups that find their values now */
    this.settling = new Set();
    /** @type {Promise<void>} one change at a time */
    this.turn = Promise.resolve();
    this.timer = setInterval(() => this.verify(), VERIFY_MS);
  }

  /** Groups that this camera has. @returns {Group[]} */
  groups() {
    return NAMES.filter((group) => canHold(this.capabilities, group));
  }

  /** All groups as they are, as the program is told. @returns {Record<string, Held>} */
  report() {
    return Object.fromEntries(this.groups().map((group) => [group, this.held[group] ?? { asked: {}, got: this.readBack(GROUPS[group].mode ? { [GROUPS[group].mode]: '' } : {}) }]));
  }

  /** @param {Groups} wanted */
  async apply(wanted) {
    const known = NAMES.filter((group) => group in wanted && this.isKnown(group));
    const isFound = (/** @type {Group} */ group) => !!wanted[group] && !!GROUPS[group].mode && !Object.keys(wanted[group] ?? {}).length;
    const found = known.filter(isFound);
    Object.assign(this.wishes, wanted);
    for (const group of known) this.settling.delete(group);
    for (const group of found) this.settling.add(group);
    await this.inTurn(known.filter((group) => !wanted[group] || isFound(group)), (group) => this.release(group));
    if (found.length) {
      this.told(false);
      await new Promise((over) => setTimeout(over, SETTLE_MS));
    }
    const due = known.filter((group) => wanted[group] && !this.refused[group] && this.wishes[group] === wanted[group]);
    await this.inTurn(due, (group) => this.hold(group, this.valuesFor(group, wanted[group] ?? {})));
    for (const group of found) if (this.wishes[group] === wanted[group]) this.settling.delete(group);
    this.told(true);
  }

  /** @param {Group} group @returns {boolean} */
  isKnown(group) {
    delete this.refused[group];
    const isKnown = canHold(this.capabilities, group);
    if (!isKnown) this.refused[group] = 'this camera cannot lock it';
    return isKnown;
  }

  /** One after the other, after all that is under way. @param {Group[]} groups @param {(group: Group) => Promise<void>} change @returns {Promise<void>} */
  inTurn(groups, change) {
    this.turn = this.turn.then(async () => {
      for (const group of groups) if (this.track.readyState === 'live') await change(group);
    });
    return this.turn;
  }

  /** @param {Group} group @param {Values} values - empty: those of now @returns {Values} */
  valuesFor(group, values) {
    const { mode, values: names } = GROUPS[group];
    const now = /** @type {any} */ (this.track.getSettings());
    const range = this.capabilities[names[0]];
    if (group === 'zoom' && values.zoom === undefined) return { zoom: Math.max(1, range.min) };
    /** @type {Values} */
    const asked = mode ? { [mode]: 'manual' } : {};
    for (const name of names) {
      const value = values[name] ?? now[name];
      if (name in this.capabilities && value !== undefined) asked[name] = value;
    }
    return asked;
  }

  /** @param {Group} group */
  async release(group) {
    const { mode } = GROUPS[group];
    const isFree = mode && this.capabilities[mode].includes('continuous');
    delete this.held[group];
    if (isFree) await this.constrain(group, { [mode]: 'continuous' });
    else if (group === 'torch') await this.constrain(group, { torch: false });
    else delete this.sets[group];
    // Only where a person or the program has let it go: else it is held in a moment anyway.
    if (mode && this.wishes[group] === null && /** @type {any} */ (this.track.getSettings())[mode] === 'manual') this.refused[group] = 'the camera does not go back to automatic';
  }

  /** @param {Group} group @param {Values} asked */
  async hold(group, asked) {
    if (!(await this.constrain(group, asked))) return;
    const got = this.readBack(asked);
    this.held[group] = { asked, got };
    const other = this.differing(asked, got);
    if (other) this.refused[group] = `${other} is ${got[other] ?? 'not told'}, not ${asked[other]}`;
  }

  /** Set a group beside all others that are set. @param {Group} group @param {Values} values @returns {Promise<boolean>} */
  async constrain(group, values) {
    const before = this.sets[group];
    this.sets[group] = values;
    try {
      await this.track.applyConstraints({ ...this.base, advanced: /** @type {any} */ (Object.values(this.sets)) });
      return true;
    } catch (error) {
      if (before) this.sets[group] = before;
      else delete this.sets[group];
      this.refused[group] = /** @type {Error} */ (error).message || 'the camera refused it';
      return false;
    }
  }

  /** @param {Values} asked @returns {Values} */
  readBack(asked) {
    const now = /** @type {any} */ (this.track.getSettings());
    return Object.fromEntries(Object.keys(asked).filter((name) => now[name] !== undefined).map((name) => [name, now[name]]));
  }

  /** @param {Values} asked @param {Values} got @returns {string | undefined} the first value that is another */
  differing(asked, got) {
    return Object.keys(asked).find((name) => !isSame(asked[name], got[name], this.capabilities[name]?.step ?? 0));
  }

  /** What is held must stay: a browser or a phone may have let go of it meanwhile. */
  verify() {
    if (this.settling.size || this.track.readyState !== 'live') return;
    const moved = /** @type {Group[]} */ (Object.keys(this.held)).filter((group) => {
      const { got } = /** @type {Held} */ (this.held[group]);
      return this.differing(got, this.readBack(got));
    });
    if (moved.length) this.apply(Object.fromEntries(moved.map((group) => [group, this.held[group]?.asked])));
  }

  stop() {
    clearInterval(this.timer);
  }
}
