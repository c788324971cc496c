// SPDX-License-Identifier: Apache-2.0
import {el} from '../lib/dom.js';
import {field} from '../lib/dialog.js';
import {duration} from '../lib/format.js';
import {live} from '../lib/live.js';
import {post} from '../lib/api.js';
import {fill, texts} from '../texts.js';

const t = texts.login;

function wordsOf(error) {
  if (error.status === 401) return t.wrong;
  return error.status === 429 ? fill(t.later, {long: duration(error.body.retry_s ?? 60)}) : error.message;
}

export function show(main, _, scope) {
  const {session} = live;
  const head = el('h1', {tabindex: -1}, t.title);
  if (session.user || !session.login) {
    main.append(el('section', {class: 'panel narrow'}, head, el('p', {}, session.user ? fill(t.as, {user: session.user}) : t.off)));
    return;
  }
  const user = el('input', {name: 'user', autocomplete: 'username', required: true, autocapitalize: 'none', spellcheck: 'false'});
  const password = el('input', {name: 'password', type: 'password', autocomplete: 'current-password', required: true});
  const trouble = el('p', {class: 'trouble', role: 'alert', hidden: true});
  const go = el('button', {type: 'submit', class: 'main'}, t.enter);
  const enter = async (event) => {
    event.preventDefault();
    go.disabled = true;
    trouble.hidden = true;
    try {
      await post('/api/login', {user: user.value, password: password.value}, scope.signal);
      if (location.hash === '#/login') history.replaceState(null, '', '#/');
      await live.renewSession();
    } catch (error) {
      password.value = '';
      trouble.textContent = wordsOf(error);
      trouble.hidden = false;
      password.focus();
    } finally {
      go.disabled = false;
    }
  };
  main.append(el('form', {class: 'panel narrow', submit: enter}, head, session.must_login ? el('p', {}, t.needed) : null,
    field(t.user, user), field(t.password, password), trouble, go));
}
