// What can be made of a scan that is over: other files, a check, a print. A print asks before it starts, naming file and printer.

import { begin, command } from './connection.js';
import { byId, data, onPress, sentence, show, text } from './dom.js';

const NOTHING = { stage: 'over', words: '', level: 'unknown', share: 0, asks: '' };

export class Workshop {
  /** @param {() => any} state - the newest */
  constructor(state) {
    this.state = state;
    const [answer, value] = [byId('make-answer'), (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (byId(id)).value.trim()];
    this.question = /** @type {HTMLDialogElement} */ (byId('make-question'));
    onPress(byId('make-save'), () => command('save_model', { format: value('make-format') }), answer);
    onPress(byId('make-check'), () => command('check_model', { bed: value('make-bed') }), answer);
    onPress(byId('make-print'), () => this.print(value('make-printer'), value('make-bed')), answer);
    onPress(byId('make-pause'), () => command('pause_print'), answer);
    onPress(byId('make-cancel'), () => command('cancel_print'), answer);
    byId('make-yes').addEventListener('click', () => this.answered(true));
    byId('make-no').addEventListener('click', () => this.answered(false));
    this.question.addEventListener('cancel', () => this.answered(false));
    this.asked = '';
  }

  printing() {
    return this.state()?.printing ?? NOTHING;
  }

  /** Prepare a print; the question comes when it is ready. @param {string} printer @param {string} bed */
  print(printer, bed) {
    this.asked = '';
    return begin('prepare_print', { printer, bed });
  }

  /** @param {boolean} agrees */
  async answered(agrees) {
    const { asks } = this.printing();
    if (this.question.open) this.question.close();
    const answer = agrees ? await begin('print', { confirm: asks }) : await begin('cancel_print');
    text(byId('make-answer'), answer.problem ? sentence(`${answer.problem}: ${answer.remedy}`) : '');
  }

  /** @param {any} state */
  show(state) {
    const { stage, words, level, share, asks } = state.printing ?? NOTHING;
    const isOn = stage === 'printing' || stage === 'paused';
    data(byId('make-state'), 'level', isOn || stage === 'asks' ? 'good' : level);
    text(byId('make-words'), sentence(words));
    show(byId('make-state'), !!words);
    show(byId('make-pause'), isOn);
    text(byId('make-pause'), stage === 'paused' ? 'Go on' : 'Pause');
    show(byId('make-cancel'), stage !== 'over');
    show(byId('make-print'), stage === 'over');
    show(byId('make-share'), isOn);
    /** @type {HTMLProgressElement} */ (byId('make-share')).value = share;
    // Only the browser that is looked at asks, and each question once: others may look, too.
    if (asks && asks !== this.asked && document.visibilityState === 'visible' && document.body.dataset.step === 'scan') {
      this.asked = asks;
      text(byId('make-asks'), sentence(words));
      if (!this.question.open) this.question.showModal();
    }
    if (!asks && this.question.open) this.question.close();
  }
}
