// SPDX-License-Identifier: Apache-2.0
// Starts the event stream, the frame of the page, and the view that the address names.
import {live} from './lib/live.js';
import {Scope} from './lib/scope.js';
import {Shell} from './lib/shell.js';
import {el} from './lib/dom.js';
import {fill, texts} from './texts.js';

const VIEWS = {
  '': () => import('./views/overview.js'), loop: () => import('./views/loop.js'), alarms: () => import('./views/alarms.js'),
  journal: () => import('./views/journal.js'), trends: () => import('./views/trends.js'), reports: () => import('./views/reports.js'),
  system: () => import('./views/system.js'), fleet: () => import('./views/fleet.js'), valve: () => import('./views/valve.js'), login: () => import('./views/login.js'),
};

// Parts that are hidden on a page without a box or a fleet (page.yaml: box, fleet).
const OF_FLEET = new Set(['fleet', 'valve']), OF_PAGE = new Set(['login']);
const has = (view) => OF_PAGE.has(view) || (OF_FLEET.has(view) ? live.session?.fleet : live.session?.box !== false);

const LATE_MS = 2000;
const shell = new Shell(document.getElementById('app'));
let scope = null;
let first = true;
let route = null;

// "#/loop/FIC-101?from=1&to=2" is {view: 'loop', parts: ['FIC-101'], options: {from: '1', to: '2'}}
function address() {
  const [path, search = ''] = location.hash.replace(/^#\/?/, '').split('?');
  const parts = path.split('/').map((part) => {
    try {
      return decodeURIComponent(part);
    } catch {
      return part;
    }
  });
  const view = parts[0] || has('') ? parts[0] : 'fleet';
  return {view, parts: parts.slice(1), options: Object.fromEntries(new URLSearchParams(search))};
}

function trouble(main, error) {
  main.replaceChildren(el('section', {class: 'panel'}, el('h1', {tabindex: -1}, texts.brand),
    el('p', {}, fill(texts.failed, {why: error.message})),
    el('button', {click: () => show()}, texts.again)));
}

// Shows "Loading" if a part does not arrive within 2 s, because an empty page looks broken.
async function loaded(part) {
  const notice = el('p', {class: 'nothing', role: 'status'}, texts.loading);
  const timer = setTimeout(() => { if (!shell.main.childElementCount) shell.main.append(notice); }, LATE_MS);
  try {
    return await part;
  } finally {
    clearTimeout(timer);
    notice.remove();
  }
}

async function show() {
  const wanted = live.session?.must_login ? {view: 'login', parts: [], options: {}} : address();
  // A view that can follow the address itself does so. For example, the list of alarms keeps its position.
  if (route?.view === wanted.view && scope?.follow?.(wanted)) { route = wanted; return; }
  route = wanted;
  scope?.end();
  const mine = scope = new Scope();
  const load = has(wanted.view) ? VIEWS[wanted.view] : null;
  shell.mark({loop: '', valve: 'fleet'}[wanted.view] ?? wanted.view);
  const main = shell.main;
  try {
    if (!load) throw new Error(texts.notFound);
    const view = await loaded(load());
    if (mine.over) return;
    main.replaceChildren();
    main.dataset.view = wanted.view || 'overview';
    await view.show(main, wanted, mine);
  } catch (error) {
    if (mine.over || error.name === 'AbortError') return;
    trouble(main, error);
  }
  if (mine.over) return;
  shell.title(main.querySelector('h1')?.textContent ?? texts.brand);
  // Announces the view to screen readers, except at the first load, when the page itself is announced.
  if (!first) main.querySelector('h1')?.focus({preventScroll: true});
  if (!first) scrollTo(0, 0);
  first = false;
}

addEventListener('hashchange', show);
// A page that the browser keeps for "back" needs no stream.
addEventListener('pagehide', () => live.disconnect());
addEventListener('pageshow', ({persisted}) => { if (persisted && live.session && !live.session.must_login) live.connect(); });
live.addEventListener('session', () => {
  shell.session();
  show();
  // Runs immediately, without waiting for the log-in.
  if (live.session.must_login) shell.clear();
});

async function begin() {
  try {
    await loaded(live.start());
  } catch (error) {
    trouble(shell.main, error);
    setTimeout(begin, 2000);
    return;
  }
  shell.session();
  show();
}
begin();
