// SPDX-License-Identifier: Apache-2.0
// Performance of the alarm system, folded below the alarms and requested when it is opened.
import {TARGETS, figuresOf, reachesLess} from '../lib/alarm_figures.js';
import {el, icon, scroller, table, unseen} from '../lib/dom.js';
import {NONE, count, percent, significant} from '../lib/format.js';
import {get, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {ownerHref} from '../lib/incidents.js';
import {wall} from '../lib/shell.js';
import {changeName, fill, ownerName, texts} from '../texts.js';

const t = texts.alarmFigures;
const HOURS = [8, 24, 168, 720], USUAL_HOURS = 24, ROUND_MS = 60_000;
const SHOWN = {per_hour: (v) => significant(v, 2), flood_percent: (v) => percent(v, 1), top_percent: (v) => percent(v, 0)};
const number = {class: 'number'};

// Whether a figure meets its target, as a sign and a word.
const sign = (right) => (right === null ? '' : el('span', {class: 'state'}, el('span', {class: 'sign'}, icon(right ? 'ok' : 'low')), el('span', {}, right ? t.within : t.beyond)));

function figures(answer) {
  const columns = [{head: t.figure, row: true}, {head: t.value, ...number}, {head: t.target, ...number}, {head: t.judged}];
  return scroller(t.caption, table(t.caption, columns, figuresOf(answer).map(([key, value, right]) => [t.names[key], value === null ? NONE : (SHOWN[key] ?? count)(value),
    t.targets[key] ? fill(t.targets[key], {n: TARGETS[key]}) : '', sign(right)]), {captionHidden: true, class: 'lines as-cards'}));
}

// Lists of alarms by name: most frequent, chattering, stale.
function named(title, list, heads, cells) {
  if (!list.length) return null;
  return [el('h2', {}, title), scroller(title, table(title, [{head: texts.alarm.loop}, {head: texts.alarm.alarm, row: true}, ...heads.map((head) => ({head, class: 'number'}))],
    list.map((one) => [el('a', {href: ownerHref(one.loop)}, ownerName(one.loop)), el('a', {href: `#/alarms/${encodeURIComponent(one.loop)}/${encodeURIComponent(one.alarm)}`}, changeName(one.alarm)), ...cells(one)]),
    {captionHidden: true, class: 'lines as-cards'}))];
}

function parts(answer, hours) {
  const span = fill(reachesLess(answer, hours) ? t.reaches : t.span, {from: wall().dateTime(answer.from_ms), to: wall().dateTime(answer.to_ms)});
  return [el('p', {class: 'soft small'}, span), answer.came ? null : el('p', {class: 'nothing'}, t.nothing), figures(answer),
    named(t.top, answer.top, [t.times, t.share], (one) => [count(one.count), percent(one.percent, 0)]),
    named(t.chattering, answer.chattering, [t.inAMinute], (one) => [count(one.count)]),
    named(t.stale, answer.stale, [t.since], (one) => [wall().dateTime(one.since_ms)])].flat().filter(Boolean);
}

export function alarmFigures(scope) {
  const place = el('div', {class: 'told'}, el('p', {class: 'nothing'}, texts.loading)), old = el('p', {class: 'trouble', hidden: true});
  const hours = el('select', {'aria-label': t.hours, change: () => load()}, HOURS.map((h) => el('option', {value: h, selected: h === USUAL_HOURS}, t.spans[h])));
  const node = el('details', {class: 'alarm-figures', toggle: () => load()}, el('summary', {}, t.title), el('div', {class: 'tools'}, hours, unseen(t.about)), old, place);
  let asked = 0, known = false;
  async function load() {
    if (!node.open) return;
    const mine = ++asked, wish = Number(hours.value);
    try {
      const answer = await get(`/api/alarm-figures${query({hours: wish})}`, scope.signal);
      if (mine !== asked) return;
      known = true;
      old.hidden = true;
      place.replaceChildren(...parts(answer, wish));
    } catch (error) {
      if (error.name === 'AbortError' || mine !== asked) return;
      // Figures have their own times: the displayed ones are valid for the displayed times.
      old.hidden = false;
      old.textContent = fill(texts.failed, {why: error.message});
      if (!known || live.stale) place.replaceChildren(el('p', {class: 'nothing'}, texts.notKnownNow));
    }
  }
  scope.every(ROUND_MS, load);
  scope.on(live, 'stale', load);
  return node;
}
