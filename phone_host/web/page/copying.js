// Buttons that copy the text before them: the static pages' commands.

/** @param {HTMLElement} button */
function connect(button) {
  const source = /** @type {HTMLElement} */ (button.previousElementSibling);
  const said = (/** @type {boolean} */ done) => (button.textContent = done ? 'copied' : 'selected: copy it');
  const select = () => {
    getSelection()?.selectAllChildren(source);
    let done = false;
    try {
      done = document.execCommand('copy'); // works from file://, where there is no clipboard
    } catch {
      done = false;
    }
    said(done);
  };
  button.hidden = false;
  button.addEventListener('click', () => {
    if (navigator.clipboard) navigator.clipboard.writeText(source.textContent ?? '').then(() => said(true), select);
    else select();
  });
}

/** Connect all of them, and tell that the page is ready. */
export function connectCopying() {
  for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('button.copy'))) connect(button);
  document.documentElement.dataset.ready = 'yes';
}
