// The way from this browser's camera to the program: one WebSocket for frames, one for the clock. Comes back by itself. Runs in the worker.

/** @typedef {'connecting' | 'open' | 'lost' | 'refused'} Line */

const FIRST_WAIT_MS = 400;
const MOST_WAIT_MS = 4000;
/** A program that leaves echoes unanswered for so long is gone, whatever the network still believes. */
const SILENT_MS = 5000;
/** Echoes come faster at first, as with the board. */
const EAGER_MS = 3000;
const EAGER_EVERY_MS = 100;
const EVERY_MS = 1000;

/** Now, on the line on which frames are stamped, too: µs since 1970 as this browser saw it when the worker began; it never steps. @returns {number} */
export const nowUs = () => (performance.timeOrigin + performance.now()) * 1000;

/** The clock's echoes, on a socket of their own: behind frames they would wait. */
class Clock {
  /** @param {string} address @param {string} session @param {() => void} silent - called once when nobody answers any more */
  constructor(address, session, silent) {
    this.silent = silent;
    this.number = 0;
    this.begunUs = this.heardUs = nowUs();
    this.everyMs = 0;
    /** Least round trip, µs. */
    this.leastUs = Number.POSITIVE_INFINITY;
    this.timer = 0;
    this.socket = new WebSocket(address);
    this.socket.addEventListener('open', () => {
      this.say({ kind: 'hello', session });
      this.ask();
    });
    this.socket.addEventListener('message', ({ data }) => this.hear(nowUs(), JSON.parse(data)));
    this.socket.addEventListener('close', () => this.lost());
    this.patience = setInterval(() => nowUs() - this.heardUs > 1000 * SILENT_MS && this.lost(), EVERY_MS);
  }

  /** @param {object} message */
  say(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  ask() {
    this.number += 1;
    this.say({ kind: 'echo', n: this.number, t0: nowUs() });
    const isEager = nowUs() - this.begunUs < 1000 * EAGER_MS;
    this.timer = self.setTimeout(() => this.ask(), this.everyMs || (isEager ? EAGER_EVERY_MS : EVERY_MS));
  }

  /** @param {number} t3 - µs @param {any} said */
  hear(t3, said) {
    this.heardUs = t3;
    if (said.kind === 'echo') {
      this.say({ kind: 'echoed', n: said.n, t0: said.t0, t3 });
      this.leastUs = Math.min(this.leastUs, t3 - said.t0 - Number(BigInt(said.t2) - BigInt(said.t1)) / 1000);
    }
    if (said.kind === 'pace' && said.hz > 0) this.everyMs = Math.max(EAGER_EVERY_MS, 1000 / said.hz);
  }

  lost() {
    if (!this.close()) return;
    this.silent();
  }

  /** @returns {boolean} whether it was open until now */
  close() {
    if (!this.patience) return false;
    clearTimeout(this.timer);
    clearInterval(this.patience);
    this.patience = 0;
    this.socket.close();
    return true;
  }
}

export class Link {
  /**
   * @param {string} origin - such as ws://127.0.0.1:8765
   * @param {() => object} hello - what to say first
   * @param {{line: (line: Line, said?: any) => void, said: (message: any) => void}} told
   */
  constructor(origin, hello, told) {
    this.origin = origin;
    this.hello = hello;
    this.told = told;
    this.wait = FIRST_WAIT_MS;
    /** @type {?Clock} */
    this.clock = null;
    this.isOver = false;
    /** How many frames may be sent on this connection, and how many were. */
    this.granted = this.sent = 0;
    this.isWelcome = this.isRefused = this.isLost = false;
    this.socket = this.open();
  }

  /** @returns {WebSocket} */
  open() {
    this.granted = this.sent = 0;
    this.isWelcome = this.isRefused = this.isLost = false;
    const socket = new WebSocket(`${this.origin}/ws/camera`);
    socket.addEventListener('open', () => socket.send(JSON.stringify(this.hello())));
    socket.addEventListener('message', ({ data }) => socket === this.socket && this.hear(JSON.parse(data)));
    socket.addEventListener('close', () => this.lost(socket));
    setTimeout(() => !this.isWelcome && this.lost(socket), SILENT_MS);
    return socket;
  }

  /** @param {any} said */
  hear(said) {
    if (said.kind === 'welcome') {
      this.isWelcome = true;
      this.wait = FIRST_WAIT_MS;
      const { socket } = this;
      this.clock = new Clock(`${this.origin}/ws/camera/clock`, said.session, () => this.lost(socket));
      this.told.line('open');
    }
    if (said.kind === 'refused') {
      this.isRefused = true;
      this.told.line('refused', { problem: said.problem, remedy: said.remedy });
    }
    if (said.kind === 'credit') this.granted = Math.max(this.granted, said.up_to);
    this.told.said(said);
  }

  /** @param {object} message */
  say(message) {
    if (this.isWelcome && this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** @param {Uint8Array} message */
  send(message) {
    this.sent += 1;
    this.socket.send(message);
  }

  /** @param {number} under_way - frames that are being encoded @param {number} bytes - that may wait in the socket */
  hasRoom(under_way, bytes) {
    return this.isWelcome && this.socket.readyState === WebSocket.OPEN && this.granted > this.sent + under_way && this.socket.bufferedAmount <= bytes;
  }

  /** The connection is gone, or nobody answers on it. @param {WebSocket} socket */
  lost(socket) {
    if (this.isOver || this.isLost || socket !== this.socket) return;
    socket.close();
    this.clock?.close();
    this.clock = null;
    if (!this.isRefused) this.told.line('lost');
    this.isWelcome = false;
    this.isLost = true;
    setTimeout(() => {
      if (!this.isOver) this.socket = this.open();
    }, this.wait);
    this.wait = Math.min(MOST_WAIT_MS, this.wait * 1.7);
  }

  /** @param {string} words - why, if the person stopped it; empty: another connection follows */
  close(words) {
    if (words) this.say({ kind: 'bye', words });
    this.isOver = true;
    this.clock?.close();
    this.socket.close();
  }
}
