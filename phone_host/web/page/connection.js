// The one connection to the server: what it tells goes to listeners, what the page wants goes back. Comes back by itself.

import { decode, split } from './message.js';
import { token } from './token.js';

/** @typedef {'connecting' | 'open' | 'lost' | 'ended' | 'refused'} Line */

/** What a server says that ends (RFC 6455, section 7.4.1). */
const GOING_AWAY = 1001;

const FIRST_WAIT_MS = 400;
const MOST_WAIT_MS = 4000;
const UNSEEN_MS = 250;

/** Until the next frame is drawn; a page that nobody sees draws none, and goes on all the same. @returns {Promise<unknown>} */
const nextFrame = () => Promise.race([new Promise((drawn) => requestAnimationFrame(drawn)), new Promise((over) => setTimeout(over, UNSEEN_MS))]);

export class Connection {
  /**
   * @param {object} told
   * @param {(line: Line) => void} told.line
   * @param {(state: any) => void} told.state
   * @param {(pair: import('./message.js').Pair) => void} told.pair
   */
  constructor(told) {
    this.told = told;
    this.wait = FIRST_WAIT_MS;
    /** @type {?WebSocket} */
    this.socket = null;
    this.wanted = '';
    this.hasEnded = false;
    this.open();
  }

  open() {
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.addEventListener('open', () => {
      this.wait = FIRST_WAIT_MS;
      this.hasEnded = false;
      this.told.line('open');
      if (this.wanted) socket.send(this.wanted);
    });
    socket.addEventListener('message', ({ data }) => {
      if (typeof data === 'string') this.text(JSON.parse(data));
      else this.pair(data);
    });
    socket.addEventListener('close', ({ code }) => this.closed(code));
  }

  /** @param {any} message */
  text(message) {
    if (message.kind === 'state') this.told.state(message);
  }

  /** A pair is acknowledged once it is shown; until then the server sends no other. @param {ArrayBuffer} buffer */
  async pair(buffer) {
    const socket = this.socket;
    const { number } = split(buffer).head;
    try {
      const pair = await decode(buffer);
      await nextFrame();
      this.told.pair(pair);
    } finally {
      // One pair that cannot be shown must not be the last.
      if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ kind: 'ack', number }));
    }
  }

  /** Say which pictures are looked at. @param {string[]} views @param {number} width - px @param {number} hz */
  want(views, width, hz) {
    const wanted = JSON.stringify({ kind: 'want', views, width, hz });
    if (wanted === this.wanted) return;
    this.wanted = wanted;
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(wanted);
  }

  /** A socket that was never open does not say why: a plain request does. @param {number} code */
  async closed(code) {
    if (code === GOING_AWAY) this.hasEnded = true;
    let line = /** @type {Line} */ (this.hasEnded ? 'ended' : 'lost');
    try {
      const answer = await fetch('/api/state', { cache: 'no-store' });
      if (answer.status === 401 || answer.status === 403) line = 'refused';
    } catch {
      // nobody answers: it stays lost
    }
    this.told.line(line);
    window.setTimeout(() => this.open(), this.wait);
    this.wait = Math.min(MOST_WAIT_MS, this.wait * 1.7);
  }
}

/** @typedef {{problem: string, remedy: string}} Trouble */

const NO_TOKEN = { problem: 'this browser may watch, but not control', remedy: 'open the address that phone-host printed, with its token' };
const UNREACHED = { problem: 'the program does not answer', remedy: 'check that phone-host is running' };

/**
 * Ask the server for something.
 * @param {string} path @param {object} body
 * @returns {Promise<any>} its answer; an object with `problem` and `remedy` where it refused or did not answer
 */
export async function post(path, body) {
  try {
    const headers = { 'Content-Type': 'application/json', Authorization: `Bearer ${token()}` };
    const answer = await fetch(path, { method: 'POST', headers, body: JSON.stringify(body) });
    if (answer.status === 401) return NO_TOKEN;
    const value = await answer.json();
    if (answer.ok || value.problem) return value;
    return { problem: `the program answered ${answer.status}`, remedy: 'open the page again' };
  } catch {
    return UNREACHED;
  }
}

/** Give a command. @param {string} name @param {Record<string, string>} [values] @returns {Promise<{words?: string, problem?: string, remedy?: string}>} */
export const command = (name, values = {}) => post('/api/command', { do: name, values });

/** Begin something. The state shows that it goes on; words would outlive it. @param {string} name @param {Record<string, string>} [values] @returns {Promise<{problem?: string, remedy?: string}>} */
export async function begin(name, values = {}) {
  const answer = await command(name, values);
  return answer.problem ? answer : {};
}
