// The token of the first URL: commands need it (reading does not). A wrong one never comes as far as here.

const KEY = 'token';

/** Take the token from the address, and the address is clean again; the step that it names stays. */
export function takeToken() {
  const found = new URLSearchParams(location.search).get('token');
  if (!found) return;
  history.replaceState(null, '', location.pathname + location.hash);
  try {
    localStorage.setItem(KEY, found);
  } catch {
    kept = found; // storage is switched off: for this visit
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
