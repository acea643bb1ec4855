// The surface of a scan as it grows: asks for what is new, once a second while somebody looks, and takes the answer apart.

/** @typedef {import('./model.js').Surface} Surface */
/** @typedef {{place: number[], low: [number, number, number], step: number, points: number, triangles: number, unseen: number}} Entry */
/** @typedef {{begun: number, newest: number, axes: import('./model.js').Axes, patches: Entry[]}} Head */

/**
 * Take an answer apart.
 * @param {ArrayBuffer} buffer - header length (uint32, little endian), header (JSON), then points, triangles and colours of each patch, then
 *   for each patch with unseen points whether its points are seen
 * @returns {{head: Head, patches: [string, Surface][]}}
 * @throws {RangeError} if it is shorter than its header says
 */
export function patchesOf(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = /** @type {Head} */ (JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))));
  let at = 4 + length;
  /** @template T @param {new (buffer: ArrayBuffer, at: number, length: number) => T} kind @param {number} count @param {number} size @returns {T} */
  const next = (kind, count, size) => {
    const from = at;
    at += Math.ceil((count * size) / 4) * 4;
    return new kind(buffer, from, count);
  };
  const patches = head.patches.map((entry) => {
    const points = next(Uint16Array, 3 * entry.points, 2);
    const triangles = next(Uint16Array, 3 * entry.triangles, 2);
    const colours = next(Uint8Array, 3 * entry.points, 1);
    const seen = new Uint8Array(entry.points).fill(1);
    const surface = { low: entry.low, step: entry.step, points, triangles, colours, noise: new Uint8Array(entry.points), seen };
    return /** @type {[string, Surface]} */ ([entry.place.join(' '), surface]);
  });
  head.patches.forEach((entry, number) => {
    if (entry.unseen) patches[number][1].seen = next(Uint8Array, entry.points, 1);
  });
  return { head, patches };
}

/** Asks for a growing surface. */
export class GrowingSurface {
  /**
   * @param {(name: string, surface: Surface, axes: import('./model.js').Axes) => void} put - takes a part
   * @param {() => void} clear - another scan begins
   */
  constructor(put, clear) {
    this.put = put;
    this.clear = clear;
    this.begun = this.newest = 0;
    this.isAsking = false;
  }

  /** Ask for what is new; all of it, in several answers if need be. @returns {Promise<boolean>} whether there was something */
  async ask() {
    if (this.isAsking) return false;
    this.isAsking = true;
    try {
      let has = false;
      while (await this.once()) has = true;
      return has;
    } catch {
      return false; // the connection tells what is wrong
    } finally {
      this.isAsking = false;
    }
  }

  /** @returns {Promise<boolean>} whether there may be more */
  async once() {
    const answer = await fetch(`/api/surface?since=${this.newest}`, { cache: 'no-store' });
    if (!answer.ok) return false;
    const { head, patches } = patchesOf(await answer.arrayBuffer());
    if (head.begun !== this.begun) {
      // Its numbers begin anew.
      const hadSome = this.newest > 0;
      this.begun = head.begun;
      this.newest = 0;
      this.clear();
      if (hadSome) return true;
    }
    for (const [name, surface] of patches) this.put(name, surface, head.axes);
    this.newest = head.newest;
    return patches.length > 0;
  }
}
