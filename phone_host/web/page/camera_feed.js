// This browser as the program's camera: opens it, hands its frames to the worker, holds its settings, and opens it again when it was taken away.

import { Awake } from './camera_awake.js';
import { canHandOver, processorOf, watch } from './camera_frames.js';
import { Locks } from './camera_locks.js';
import { capabilitiesOf, exposureOf, openCamera, rotation } from './camera_track.js';
import { passes } from './camera_words.js';
import { token } from './token.js';

const VERSION = 1;
const AGAIN_MS = 2000;
/** A camera that delivers nothing for so many seconds, though it claims to live, is opened anew. */
const MOST_STILL = 6;
/** Frames went to the program within so many seconds: it asks for them. */
const RECENT = 2;
const LOOPBACK = ['localhost', '127.0.0.1', '[::1]'];
/** Groups that are held from the start: what moves them moves the lens, or the light. */
const HELD = /** @type {const} */ (['focus', 'exposure', 'white_balance', 'zoom']);

/** @typedef {import('./camera_locks.js').Group} Group */
/** @typedef {import('./camera_track.js').Choice & {free?: Group[]}} Chosen - free: groups that stay automatic */

/** What is known once the camera was opened anew: nothing. */
const fresh = () => ({
  line: /** @type {import('./camera_link.js').Line} */ ('connecting'),
  refusal: { problem: '', remedy: '' },
  /** What the program has to say of the frames. */
  told: '',
  figures: { delivered: 0, dropped: 0, sent: 0, encoding: '', encodeMs: 0, bytes: 0, leastUs: Number.NaN, trouble: '' },
  /** Frames that went out in the last second; seconds since the last one did; seconds without one from the camera. */
  rate: 0, sinceSent: Number.POSITIVE_INFINITY, stillFor: 0,
});

export class CameraFeed {
  /** @param {Chosen} chosen @param {() => void} changed - called after each change */
  constructor(chosen, changed) {
    this.chosen = chosen;
    this.changed = changed;
    this.awake = new Awake();
    this.isOn = false;
    /** @type {'off' | 'opening' | 'failed' | 'on'} */
    this.phase = 'off';
    this.failure = '';
    this.attempt = this.timer = 0;
    /** @type {?import('./camera_track.js').Opened} */
    this.opened = null;
    /** @type {?Worker} */
    this.worker = null;
    /** @type {?Locks} */
    this.locks = null;
    /** Size and rate that the program wants. @type {import('./camera_track.js').Choice} */
    this.wanted = {};
    this.endWatch = () => {};
    this.rotation = rotation();
    this.seen = fresh();
    document.addEventListener('visibilitychange', () => this.turned());
    screen.orientation?.addEventListener('change', () => this.turned());
  }

  /** @returns {import('./camera_words.js').Facts} */
  facts() {
    const { track } = this.opened ?? {};
    return {
      isSecure: window.isSecureContext && !!navigator.mediaDevices,
      phase: this.phase,
      failure: this.failure,
      isEnded: track?.readyState === 'ended',
      isMuted: !!track?.muted,
      isVisible: document.visibilityState === 'visible',
      isTurned: this.phase === 'on' && this.rotation !== rotation(),
      line: this.seen.line,
      refusal: this.seen.refusal,
      trouble: this.seen.figures.trouble,
      told: this.seen.told,
      isAsked: this.seen.sinceSent < RECENT,
    };
  }

  start() {
    this.isOn = true;
    this.awake.want(true);
    return this.open();
  }

  stop() {
    this.isOn = false;
    this.attempt += 1;
    this.awake.want(false);
    this.shut('the camera was stopped on its page');
    this.phase = 'off';
    this.changed();
  }

  /** Another camera, size or rate. @param {import('./camera_track.js').Choice} choice */
  choose(choice) {
    Object.assign(this.chosen, choice);
    if (this.isOn) this.open();
  }

  async open() {
    const attempt = (this.attempt += 1);
    this.shut('');
    this.phase = 'opening';
    this.changed();
    try {
      if (!canHandOver()) throw new DOMException('no single frames', 'NotSupportedError');
      const opened = await openCamera({ ...this.chosen, ...this.wanted });
      if (attempt === this.attempt) this.begin(opened);
      else opened.track.stop();
    } catch (error) {
      if (attempt !== this.attempt) return;
      this.fail(/** @type {Error} */ (error).name);
    }
    this.changed();
  }

  /** @param {string} name - of the error */
  fail(name) {
    this.phase = 'failed';
    this.failure = name;
    this.isOn = passes(name);
    if (this.isOn) this.again();
    else this.awake.want(false);
  }

  /** Try again in a moment: what took the camera away may give it back. */
  again() {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.isOn && this.open(), AGAIN_MS);
  }

  /** @param {import('./camera_track.js').Opened} opened */
  begin(opened) {
    const { track, stream, base } = opened;
    this.opened = opened;
    this.phase = 'on';
    this.rotation = rotation();
    track.addEventListener('ended', () => this.taken());
    for (const name of ['mute', 'unmute']) track.addEventListener(name, () => this.turned());
    const worker = new Worker('/static/camera_worker.js', { type: 'module' });
    this.worker = worker;
    worker.addEventListener('message', ({ data }) => worker === this.worker && this.hear(data));
    worker.addEventListener('error', () => worker === this.worker && this.lose());
    const readable = processorOf(track);
    worker.postMessage(
      { do: 'start', origin: location.origin.replace(/^http/, 'ws'), isNear: LOOPBACK.includes(location.hostname), rotation: this.rotation, hello: this.hello(track, readable ? 'processor' : 'video-frame'), readable },
      readable ? [readable] : [],
    );
    if (!readable) this.endWatch = watch(stream, (message, moved) => this.worker?.postMessage(message, moved));
    this.locks = new Locks(track, base, (isDone) => (isDone ? this.locked() : this.changed()));
    const free = this.chosen.free ?? [];
    this.locks.apply(Object.fromEntries(this.locks.groups().filter((group) => HELD.some((one) => one === group) && !free.includes(group)).map((group) => [group, {}])));
  }

  /** @param {MediaStreamTrack} track @param {string} path */
  hello(track, path) {
    const settings = track.getSettings();
    return {
      kind: 'hello', version: VERSION, token: token(), browser: navigator.userAgent, track: crypto.randomUUID().replaceAll('-', ''),
      device: { id: settings.deviceId ?? '', label: track.label, facing: settings.facingMode ?? '' },
      path, isolated: window.crossOriginIsolated, settings, capabilities: capabilitiesOf(track),
    };
  }

  /** The worker itself failed. */
  lose() {
    this.shut('');
    this.fail('worker');
    this.changed();
  }

  /** Let go of camera and connection. @param {string} words - for the program; empty: it is opened again at once */
  shut(words) {
    clearTimeout(this.timer);
    this.endWatch();
    this.endWatch = () => {};
    this.locks?.stop();
    this.worker?.postMessage({ do: 'stop', words });
    this.opened?.track.stop();
    this.worker = this.locks = this.opened = null;
    this.failure = '';
    this.seen = fresh();
  }

  /** @param {any} data - of the worker */
  hear(data) {
    switch (data.said) {
      case 'line':
        this.seen.line = data.line;
        if (data.line === 'refused') this.seen.refusal = { problem: data.problem, remedy: data.remedy };
        if (data.line === 'open') this.locked();
        break;
      case 'want':
        this.want(data.want);
        break;
      case 'lock':
        this.locks?.apply(data.groups);
        break;
      case 'told':
        this.seen.told = data.words;
        break;
      case 'figures':
        this.count(data);
        break;
    }
    this.changed();
  }

  /** The program wants another size or rate. What the camera does not have is told once, and not tried again. @param {import('./camera_track.js').Choice} want */
  want({ width, height, fps }) {
    const wanted = { ...(width && height ? { width, height } : {}), ...(fps ? { fps } : {}) };
    if (JSON.stringify(wanted) === JSON.stringify(this.wanted)) return;
    this.wanted = wanted;
    const now = this.opened?.track.getSettings() ?? {};
    const isSame = (!width || (now.width === width && now.height === height) || (now.width === height && now.height === width)) && (!fps || Math.abs((now.frameRate ?? fps) - fps) < 1);
    if (!isSame) this.open();
  }

  /** Once a second. @param {any} figures */
  count(figures) {
    const { delivered, sent } = this.seen.figures;
    this.seen.figures = figures;
    this.seen.rate = figures.sent - sent;
    this.seen.sinceSent = this.seen.rate ? 0 : this.seen.sinceSent + 1;
    const mustLive = document.visibilityState === 'visible' && !this.opened?.track.muted;
    this.seen.stillFor = mustLive && figures.delivered === delivered ? this.seen.stillFor + 1 : 0;
    if (this.seen.stillFor < MOST_STILL) return;
    this.seen.stillFor = 0;
    this.taken();
  }

  /** The camera is gone: unplugged, or taken by a call. */
  taken() {
    this.turned();
    this.again();
    this.changed();
  }

  /** Tell the program how the camera stands now. */
  turned() {
    const track = this.opened?.track;
    if (!track) return;
    const settings = track.getSettings();
    this.worker?.postMessage({ do: 'now', rotation: rotation(), exposureUs: exposureOf(settings), settings });
    this.say({ kind: 'track', live: track.readyState === 'live', muted: track.muted, visible: document.visibilityState === 'visible', settings, rotation: rotation(), words: this.opened?.words ?? '' });
    this.changed();
  }

  /** @param {object} message - for the program */
  say(message) {
    this.worker?.postMessage({ do: 'say', message });
  }

  /** Tell the program what is held. */
  locked() {
    if (this.locks) this.say({ kind: 'locked', groups: this.locks.report(), refused: this.locks.refused });
    this.turned();
  }

  /** Hold a group as it is, or let it go. @param {Group} group @param {boolean} on */
  hold(group, on) {
    const free = (this.chosen.free ?? []).filter((one) => one !== group);
    this.chosen.free = on ? free : [...free, group];
    this.locks?.apply({ [group]: on ? {} : null });
  }

  /** @param {boolean} on */
  light(on) {
    this.locks?.apply({ torch: on ? { torch: true } : null });
  }
}
