// SPDX-License-Identifier: Apache-2.0
// The bell in the head: its state in a word, a dialog for its settings, and a question that is asked once.
import {Bell, PRIORITIES} from './bell.js';
import {allowSound, askToNotify, mayNotify, maySound, notify, sound} from './bell_sound.js';
import {ask, field} from './dialog.js';
import {el, icon, setAttribute, setText} from './dom.js';
import {recall, remember} from './memory.js';
import {fill, texts} from '../texts.js';

const t = texts.bell;
const MINUTES = [5, 15, 30, 60];

export class BellButton {
  // timeText(ms): formats a time on the wall's clock.
  constructor(timeText) {
    this.timeText = timeText;
    this.bell = new Bell({recall, remember}, {sound, notify});
    this.word = el('span', {});
    this.node = el('button', {type: 'button', class: 'bell plain', hidden: true, click: () => this.#choose()}, icon('alarms'), this.word);
    this.question = el('div', {class: 'question', hidden: true, role: 'region', 'aria-label': t.title}, el('span', {}, t.ask),
      el('button', {type: 'button', click: () => this.#choose()}, t.choose), el('button', {type: 'button', class: 'plain', click: () => this.#wish('off')}, t.no));
    // After an earlier consent, the first click or key in this tab enables sound again. After the browser revoked it, the next one does.
    for (const hand of ['pointerup', 'keydown']) addEventListener(hand, () => { if (this.bell.wish !== 'off' && !maySound()) this.#wake(); }, {capture: true});
  }

  // calls: as Bell.take() has them. there: whether a user is logged in at a box.
  update(calls, there) {
    this.there = there;
    this.bell.take(there ? calls : null, Date.now());
    this.show();
  }

  show() {
    const until = this.bell.silentUntil(Date.now()), {wish} = this.bell;
    this.node.hidden = !this.there;
    this.question.hidden = !this.there || this.bell.asked;
    const text = wish === 'off' ? t.off : until ? fill(t.silent, {time: this.timeText(until)}) : maySound() ? t.on[wish] : t.blocked;
    setText(this.word, text);
    setAttribute(this.node, 'aria-label', `${t.title}: ${text}`);
    setAttribute(this.node, 'data-state', wish === 'off' ? 'off' : until ? 'quiet' : maySound() ? 'on' : 'blocked');
    this.node.title = mayNotify() || wish === 'off' ? text : `${text}. ${t.noNotification}`;
  }

  async #wake() {
    await allowSound(() => this.show());
    this.show();
  }

  #wish(priority) {
    this.bell.wish = priority;
    this.show();
  }

  #choose() {
    const until = this.bell.silentUntil(Date.now());
    const choice = (name) => el('label', {class: 'choice'}, el('input', {type: 'radio', name: 'wish', value: name, required: true, checked: this.bell.asked && name === this.bell.wish}), t.wishes[name]);
    const silence = el('select', {name: 'silence'}, until ? el('option', {value: 'as'}, fill(t.silent, {time: this.timeText(until)})) : null, el('option', {value: '0'}, t.notSilent),
      MINUTES.map((n) => el('option', {value: n}, fill(texts.alarm.minutesUnit, {n}))));
    ask({
      title: t.title, label: t.set, body: [el('fieldset', {}, el('legend', {}, t.question), PRIORITIES.map(choice)), field(t.silence, silence, t.here)],
      accept: async (data) => {
        const wish = String(data.get('wish')), minutes = data.get('silence');
        if (wish !== 'off') {
          this.#wake(); // without await: a browser without a sound device may never answer
          await askToNotify();
        }
        if (minutes !== 'as') this.bell.silence(minutes === '0' ? null : Date.now() + 60_000 * Number(minutes));
        this.#wish(wish);
      },
    });
  }
}
