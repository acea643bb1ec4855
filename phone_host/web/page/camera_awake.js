// Keeps the phone awake while it is a camera, and upright as it stands.

export class Awake {
  constructor() {
    this.isWanted = false;
    /** @type {?WakeLockSentinel} */
    this.sentinel = null;
    // A screen that went dark, or a tab that was hidden, has let go of it.
    document.addEventListener('visibilitychange', () => this.ask());
  }

  /** @param {boolean} on */
  want(on) {
    this.isWanted = on;
    if (on) this.ask();
    else this.sentinel?.release().catch(() => {});
  }

  async ask() {
    if (!this.isWanted || document.visibilityState !== 'visible' || (this.sentinel && !this.sentinel.released)) return;
    try {
      this.sentinel = (await navigator.wakeLock?.request('screen')) ?? null;
      if (!this.isWanted) this.want(false); // stopped meanwhile
    } catch {
      // a battery that is low, or a browser without it: the screen may go dark
    }
  }
}

/** Whether the page may hold the screen's orientation here: on phones, in full screen. */
export const canHoldOrientation = () => matchMedia('(pointer: coarse)').matches && 'lock' in (screen.orientation ?? {}) && document.fullscreenEnabled;

/** @returns {Promise<{words?: string, problem?: string, remedy?: string}>} */
export async function holdOrientation() {
  try {
    await document.documentElement.requestFullscreen();
    await /** @type {any} */ (screen.orientation).lock(screen.orientation.type);
    return { words: 'full screen, held as it stands; leave full screen to let go' };
  } catch {
    return { problem: 'this browser does not hold the orientation', remedy: 'switch off automatic turning in the phone\u2019s settings' };
  }
}
