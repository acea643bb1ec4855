// Takes the frames of this browser's camera, stamps and encodes them, and sends what the program asks for; what it does not, is dropped and counted.
// One thread for all of it: the stamps of frames and those of the clock's echoes are on one line.

import { Encoder, HEADER_BYTES } from './camera_encode.js';
import { Link, nowUs } from './camera_link.js';

const VERSION = 1;
const MOST_UNDER_WAY = 2;
/** What a socket may hold before the next frame, beside the last frame's own bytes. */
const LEAST_WAITING_BYTES = 65_536;
const FIGURES_MS = 1000;

/** @typedef {import('./camera_encode.js').Picture} Picture */

/** @param {any} message @param {Transferable[]} [moved] */
const tell = (message, moved = []) => self.postMessage(message, /** @type {any} */ (moved));

class Feed {
  /** @param {any} start - origin, hello, isNear, rotation */
  constructor(start) {
    this.encoder = new Encoder(start.isNear);
    this.hello = start.hello;
    this.rotation = start.rotation;
    this.exposureUs = 0;
    this.delivered = this.dropped = this.sent = this.underWay = this.lastBytes = 0;
    this.encodeMs = 0;
    this.encoding = this.trouble = '';
    /** @type {Promise<void>} frames are sent in their order, whichever is encoded first */
    this.order = Promise.resolve();
    this.link = new Link(start.origin, () => this.hello, {
      line: (line, said) => tell({ said: 'line', line, ...said }),
      said: (message) => this.hear(message),
    });
    this.timer = setInterval(() => this.figures(), FIGURES_MS);
  }

  /** @param {any} message - of the program */
  hear(message) {
    const want = message.kind === 'welcome' ? message.want : message.kind === 'want' ? message : null;
    if (want) {
      this.encoder.want(want);
      tell({ said: 'want', want });
    }
    if (message.kind === 'welcome' && message.locks) tell({ said: 'lock', groups: message.locks.groups ?? message.locks });
    if (message.kind === 'lock') tell({ said: 'lock', groups: message.groups });
    if (message.kind === 'told') tell({ said: 'told', words: message.words });
  }

  /** @param {Picture} picture - ours from now on @param {number} timestampUs @param {number} captureUs @param {number} callbackUs */
  async take(picture, timestampUs, captureUs, callbackUs) {
    const { delivered: sequence, dropped } = this;
    this.delivered += 1;
    if (this.underWay >= MOST_UNDER_WAY || !this.link.hasRoom(this.underWay, Math.max(this.lastBytes, LEAST_WAITING_BYTES))) {
      picture.close();
      this.dropped += 1;
      return;
    }
    this.underWay += 1;
    const { socket } = this.link;
    const before = this.order;
    /** @type {() => void} */
    let passOn = () => {};
    this.order = new Promise((done) => (passOn = done));
    try {
      const begun = performance.now();
      const encoded = await this.encoder.encode(picture);
      this.encodeMs = performance.now() - begun;
      const encodedUs = nowUs();
      await before;
      // A frame for a connection that is gone is none for the next: that one's credit has not come yet.
      if (this.link.socket !== socket || socket.readyState !== WebSocket.OPEN) {
        this.dropped += 1;
        return;
      }
      this.write(encoded, { sequence, dropped, timestampUs, captureUs, callbackUs, encodedUs });
      this.link.send(encoded.message);
      this.encoder.done(encoded);
      this.sent += 1;
      this.lastBytes = encoded.message.length;
      this.encoding = encoded.encoding;
      this.trouble = '';
    } catch (error) {
      picture.close();
      this.dropped += 1;
      this.trouble = /** @type {Error} */ (error).message;
    } finally {
      this.underWay -= 1;
      passOn();
    }
  }

  /** @param {import('./camera_encode.js').Encoded} encoded @param {{sequence: number, dropped: number, timestampUs: number, captureUs: number, callbackUs: number, encodedUs: number}} stamps */
  write({ message, encoding, width, height }, stamps) {
    const head = new DataView(message.buffer, message.byteOffset, HEADER_BYTES);
    head.setUint8(0, VERSION);
    head.setUint8(1, encoding === 'luma' ? 1 : 0);
    head.setUint16(2, this.rotation, true);
    head.setUint16(4, width, true);
    head.setUint16(6, height, true);
    head.setUint32(8, stamps.sequence, true);
    head.setUint32(12, stamps.dropped, true);
    [stamps.timestampUs, stamps.captureUs, stamps.callbackUs, stamps.encodedUs, nowUs()].forEach((us, k) => head.setFloat64(16 + 8 * k, us, true));
    head.setUint32(56, this.exposureUs, true);
    head.setUint32(60, 0, true);
  }

  figures() {
    const { delivered, dropped, sent, encoding, encodeMs, lastBytes, trouble } = this;
    const leastUs = this.link.clock?.leastUs ?? Number.NaN;
    tell({ said: 'figures', delivered, dropped, sent, encoding, encodeMs, bytes: lastBytes - HEADER_BYTES, leastUs, trouble });
  }
}

/** @type {Feed} */
let feed;

/** Chromium's way: frames come as a stream, without the page's own thread. @param {ReadableStream<VideoFrame>} readable */
async function drain(readable) {
  const reader = readable.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    feed.take(value, value.timestamp, Number.NaN, nowUs());
  }
}

self.addEventListener('message', ({ data }) => {
  switch (data.do) {
    case 'start':
      feed = new Feed(data);
      if (data.readable) drain(data.readable);
      break;
    case 'frame':
      feed.take(data.picture, data.timestampUs, data.captureUs, data.callbackUs);
      break;
    case 'now':
      feed.rotation = data.rotation;
      feed.exposureUs = data.exposureUs;
      feed.hello.settings = data.settings;
      break;
    case 'say':
      feed.link.say(data.message);
      break;
    case 'stop':
      clearInterval(feed.timer);
      feed.link.close(data.words);
      setTimeout(() => self.close(), 200); // the goodbye is under way
      break;
  }
});
