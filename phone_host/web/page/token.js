// The token of the first URL. The server hands it over in the address's fragment, once; commands need it (reading does not).

const KEY = 'token';

/** Take the token from the address, and the address is clean again. */
export function takeToken() {
  const found = /^#token=(.+)$/.exec(location.hash);
  if (!found) return;
  history.replaceState(null, '', location.pathname);
  try {
    localStorage.setItem(KEY, decodeURIComponent(found[1]));
  } catch {
    kept = decodeURIComponent(found[1]); // storage is switched off: for this visit
  }
}

let kept = '';

/** @returns {string} empty: this browser has none */
export function token() {
  try {
    return localStorage.getItem(KEY) ?? kept;
  } catch {
    return kept;
  }
}
