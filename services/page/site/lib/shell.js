// SPDX-License-Identifier: Apache-2.0
// The frame of every view: the head with alarms, clock and user, the links to the views, and the notice of old values.
import {BellButton} from './bell_button.js';
import {actions} from './dialog.js';
import {waits} from './codes.js';
import {el, icon, setAttribute, setText} from './dom.js';
import {WallClock, duration} from './format.js';
import {linesOf, partOf} from './incidents.js';
import {live} from './live.js';
import {remember} from './memory.js';
import {readColours} from './spark.js';
import {tabIcon, tabTitle} from './tab.js';
import {changeName, fill, ownerName, texts} from '../texts.js';

const VIEWS = [['', 'overview'], ['alarms', 'alarms'], ['trends', 'trends'], ['journal', 'journal'], ['reports', 'reports'], ['system', 'system'], ['fleet', 'fleet']];

const keyOf = (line) => `${line.loop}\n${line.incident?.id ?? line.name}\n${line.raised_ms}`;

let clock = new WallClock('UTC');
export const wall = () => clock;

export class Shell {
  #links = new Map();
  #known = null; // announced alarms
  #title = texts.brand;
  #calls = []; // alarms that wait

  constructor(root) {
    this.bell = new BellButton((ms) => clock.time(ms).slice(0, 5));
    document.documentElement.lang = texts.language;
    this.main = el('main', {id: 'content', tabindex: -1});
    this.status = el('div', {class: 'unseen', role: 'status', 'aria-live': 'polite'});
    this.banner = el('div', {class: 'banner', role: 'alert', hidden: true});
    this.bannerText = el('span', {});
    this.bannerAge = el('span', {class: 'age', 'aria-hidden': 'true'});
    root.append(
      el('a', {class: 'skip', href: '#content', click: (event) => { event.preventDefault(); this.main.focus(); }}, texts.skip),
      this.#head(), this.#nav(), this.banner, this.bell.question, this.main, this.status);
    actions.say = (text) => this.say(text);
    readColours();
    live.addEventListener('stale', () => this.#stale());
    live.addEventListener('alarms', () => this.#alarms());
    live.addEventListener('describe', () => { this.#box(); this.#alarms(); });
    live.addEventListener('overview', () => this.#signs());
    setInterval(() => this.#tick(), 1000);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.#recolour());
  }

  #head() {
    this.host = el('span', {class: 'host'});
    this.note = el('span', {class: 'note-chip', hidden: true});
    this.link = el('span', {class: 'link'}, el('span', {class: 'dot', 'aria-hidden': 'true'}), el('span', {}, texts.head.live));
    this.summary = el('a', {class: 'summary', href: '#/alarms'}, icon('ok'), el('span', {}, texts.head.alarmsNone));
    this.clock = el('time', {class: 'clock'});
    this.zoneName = el('span', {class: 'zone-name'});
    this.zoneOffset = el('span', {});
    this.zone = el('span', {class: 'zone'}, this.zoneName, ' ', this.zoneOffset);
    this.user = el('span', {class: 'user'});
    return el('header', {class: 'head'},
      el('a', {class: 'brand', href: '#/', 'aria-label': texts.brand}, icon('valve'), el('span', {}, texts.brand)), this.host, this.note, this.link,
      el('span', {class: 'stretch'}), this.summary, this.bell.node,
      el('span', {class: 'now'}, this.clock, this.zone), this.#more());
  }

  // Theme and user; behind a button on a phone.
  #more() {
    const box = el('span', {class: 'more', id: 'more'}, this.#theme(), this.user);
    const press = el('button', {type: 'button', class: 'plain square menu', 'aria-label': texts.head.menu, 'aria-expanded': 'false', 'aria-controls': 'more', click: () => press.setAttribute('aria-expanded', String(box.classList.toggle('open')))}, '⋯');
    return el('span', {class: 'menu-box'}, press, box);
  }

  #theme() {
    const wish = document.documentElement.dataset.theme ?? 'system';
    const choices = [['system', texts.head.themeSystem], ['dark', texts.head.themeDark], ['light', texts.head.themeLight]];
    const select = el('select', {'aria-label': texts.head.theme, class: 'theme', change: () => this.#wish(select.value)},
      choices.map(([value, text]) => el('option', {value, selected: value === wish}, text)));
    return select;
  }

  #wish(theme) {
    if (theme === 'system') delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    remember('theme', theme === 'system' ? null : theme);
    this.#recolour();
  }

  #recolour() {
    readColours();
    live.dispatchEvent(new Event('theme'));
  }

  #nav() {
    return el('nav', {class: 'nav', 'aria-label': texts.nav.label}, el('ul', {}, VIEWS.map(([path, name]) => {
      const badge = el('span', {class: 'badge', hidden: true});
      const link = el('a', {href: `#/${path}`}, icon(name), el('span', {}, texts.nav[name]), badge);
      this.#links.set(path, link);
      if (name === 'alarms') this.badge = badge;
      return el('li', {hidden: path === 'fleet'}, link);
    })));
  }

  mark(path) {
    for (const [name, link] of this.#links) setAttribute(link, 'aria-current', name === path ? 'page' : null);
  }

  title(text) {
    this.#title = text;
    const n = this.#calls.length, icon = tabIcon(n, this.#calls.some(({grave}) => grave === 'high') ? 'high' : 'low', Boolean(live.stale));
    document.title = tabTitle(text, n, Boolean(live.stale));
    setAttribute(document.querySelector('link[rel=icon]'), 'href', icon);
  }

  // Announces to screen readers, used sparingly.
  say(text) {
    this.status.textContent = text;
  }

  session() {
    const s = live.session;
    clock = new WallClock(s.time_zone);
    setText(this.host, s.host ?? '');
    this.#parts(s);
    this.#tick();
    this.user.replaceChildren();
    if (s.user) {
      this.user.append(el('span', {class: 'who'}, fill(s.source === 'directory' ? texts.head.ofDirectory : texts.head.user, {user: s.user, role: texts.roles[s.role] ?? s.role})),
        el('button', {class: 'plain', click: () => live.logOut()}, texts.head.logout));
    } else if (s.login) {
      this.user.append(el('a', {class: 'button plain', href: '#/login'}, texts.head.login));
    } else {
      this.user.append(el('span', {class: 'who'}, texts.head.readOnly));
    }
  }

  // The user is no longer logged in: removes all displayed and announced data of the box.
  clear() {
    this.main.replaceChildren();
    for (const dialog of document.querySelectorAll('dialog')) dialog.close('cancel');
    document.querySelector('.toast')?.remove();
    this.say('');
    this.title(texts.login.title);
  }

  // Parts that page.yaml leaves out have no link.
  #parts({box, fleet}) {
    for (const [path, link] of this.#links) link.parentNode.hidden = path === 'fleet' ? !fleet : box === false;
    this.#signs();
  }

  // "No alarm waits" and "Live" are shown only after the box has reported it.
  #signs() {
    const box = live.session?.box !== false;
    this.summary.hidden = !box || !live.alarmsKnown;
    this.link.hidden = !box || !(live.overview || live.stale);
  }

  #box() {
    const parts = [];
    const loops = live.describe?.loops ?? [], n = loops.filter((loop) => loop.simulated).length;
    if (n) parts.push(n === loops.length ? texts.simulated : fill(texts.simulatedSome, {n, all: loops.length}));
    if ((live.describe?.accelerate ?? 1) !== 1) parts.push(fill(texts.accelerated, {factor: live.describe.accelerate}));
    this.note.hidden = !parts.length;
    setText(this.note, parts.join(', '));
  }

  #tick() {
    const now = Date.now();
    setText(this.clock, clock.time(now));
    setText(this.zoneName, clock.zone);
    setText(this.zoneOffset, clock.offsetText(now));
    this.zone.title = fill(texts.head.zone, {zone: clock.zone, offset: clock.offsetText(now)});
    this.#ring();
    if (live.stale) setText(this.bannerAge, fill(texts.stale.for, {long: duration(Math.max(0, Math.round((now - live.stale.since_ms) / 1000)))}));
  }

  #stale() {
    const {stale} = live;
    this.#signs();
    document.body.classList.toggle('stale', Boolean(stale));
    setText(this.link.lastChild, stale ? texts.head.old : texts.head.live);
    this.#alarms();
    this.banner.hidden = !stale;
    if (!stale) {
      this.banner.replaceChildren();
      if (live.overview) this.say(texts.stale.back);
      return;
    }
    const words = stale.words ? ` ${fill(texts.stale.words, {words: stale.words})}` : '';
    setText(this.bannerText, fill(texts.stale[stale.why], {time: clock.dateTime(stale.since_ms)}) + words);
    this.banner.replaceChildren(icon('bad'), this.bannerText, this.bannerAge);
    this.#tick();
  }

  #alarms() {
    this.#signs();
    const lines = linesOf(live.alarms, live.incidents);
    const wait = lines.filter((line) => waits(line.state)), active = lines.filter((line) => line.active && line.state !== 'shelved');
    // Shape and colour of the gravest waiting alarm, otherwise of the gravest active one.
    const severe = live.severe_percent, grave = (wait.length ? wait : active).some((line) => line.grave(severe) === 'high') ? 'high' : 'low';
    const parts = [wait.length ? fill(texts.head.alarmsWait, {n: wait.length}) : null, active.length ? fill(texts.head.alarmsActive, {n: active.length}) : null].filter(Boolean).join(', ');
    const old = parts ? fill(texts.head.alarmsLast, {alarms: parts}) : texts.head.alarmsOld;
    this.summary.replaceChildren(icon(live.stale ? 'bad' : parts ? grave : 'ok'), el('span', {}, live.stale ? old : parts || texts.head.alarmsNone));
    this.summary.className = `summary ${wait.length ? `waits ${grave}` : active.length ? 'active' : ''}`.trim();
    this.badge.className = `badge ${grave}`;
    this.badge.hidden = !wait.length;
    setText(this.badge, String(wait.length));
    this.#calls = wait.map((line) => ({key: keyOf(line), grave: line.grave(severe), title: `${ownerName(line.loop)}: ${changeName(line.name)}`, body: clock.dateTime(line.raised_ms),
      href: `#/alarms/${encodeURIComponent(line.loop)}/${encodeURIComponent(partOf(line))}`}));
    this.title(this.#title);
    this.#ring();
    const keys = new Map(wait.map((line) => [keyOf(line), line]));
    const fresh = this.#known ? [...keys].filter(([key]) => !this.#known.has(key)).map(([, line]) => line) : [];
    this.#known = live.alarmsKnown ? new Set(keys.keys()) : null;
    if (fresh.length === 1) this.say(fill(texts.announce.alarm, {loop: ownerName(fresh[0].loop), alarm: changeName(fresh[0].name)}));
    else if (fresh.length) this.say(fill(texts.announce.alarms, {n: fresh.length}));
  }

  // The bell also sounds when the box is silent.
  #ring() {
    const {stale, session} = live, silent = stale ? [{key: `stale ${stale.since_ms}`, grave: 'high', title: texts.stale.title, body: clock.dateTime(stale.since_ms), href: '#/system'}] : [];
    this.bell.update(live.alarmsKnown || stale ? this.#calls.concat(silent) : null, Boolean(session) && session.box !== false && !session.must_login);
  }
}
