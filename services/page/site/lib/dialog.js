// SPDX-License-Identifier: Apache-2.0
// Asks the operator questions. The browser's own dialog keeps the focus inside and returns it afterwards.
import {el} from './dom.js';
import {texts} from '../texts.js';

// Functions of the shell for code that acts.
export const actions = {say: () => {}};

// Shows a form. `accept(data, dialog)` returns a promise. If it throws, the error is shown and the form stays open.
// `long`: the title has the focus first, so that the dialog begins at its top.
export function ask({title, body, accept, label, grave = false, long = false}) {
  const trouble = el('p', {class: 'trouble', role: 'alert', hidden: true});
  const go = el('button', {type: 'submit', class: grave ? 'grave' : 'main'}, label);
  const form = el('form', {}, el('h2', {id: 'dialog-title', tabindex: long ? -1 : null, autofocus: long}, title), body, trouble,
    el('div', {class: 'buttons'}, el('button', {type: 'button', click: () => dialog.close('cancel')}, texts.cancel), go));
  const dialog = el('dialog', {'aria-labelledby': 'dialog-title'}, form);
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    go.disabled = true;
    trouble.hidden = true;
    try {
      await accept(new FormData(form));
      dialog.close('done');
    } catch (error) {
      trouble.textContent = error.message;
      trouble.hidden = false;
    } finally {
      go.disabled = false;
    }
  });
  dialog.addEventListener('close', () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}

// Shows a short message about a finished action to eyes and screen reader; it disappears after a while.
export function toast(text) {
  document.querySelector('.toast')?.remove();
  const node = el('div', {class: 'toast'}, text);
  document.body.append(node);
  actions.say(text);
  setTimeout(() => node.remove(), 6000);
}

export const field = (label, input, hint) => {
  const id = `field-${field.next = (field.next ?? 0) + 1}`;
  input.id = id;
  const about = hint ? el('small', {id: `${id}-hint`}, hint) : null;
  if (about) input.setAttribute('aria-describedby', about.id);
  return el('div', {class: 'field'}, el('label', {for: id}, label), input, about);
};
