// SPDX-License-Identifier: Apache-2.0
import {el, scroller, table, timeInput} from '../lib/dom.js';
import {field} from '../lib/dialog.js';
import {get, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {percent} from '../lib/format.js';
import {wall} from '../lib/shell.js';
import {BOX} from '../lib/codes.js';
import {ownerHref} from '../lib/incidents.js';
import {changeName, fill, ownerName, texts} from '../texts.js';

const t = texts.journal;
const MOST = 100;

const stateText = (state) => texts.alarmStates[state] ?? state;
export function changeOf(line) {
  if (line.from || line.to) return `${line.from === line.to ? '' : `${stateText(line.from)} → `}${stateText(line.to)}${line.severity_percent === null ? '' : ` (${percent(line.severity_percent, 1)})`}`;
  const word = (value) => (line.what?.startsWith('incident') && value ? changeName(value) : value || '–');
  return line.old || line.new ? `${word(line.old)} → ${word(line.new)}` : '';
}

// The daemon's text of a line, with the alarm's name as on the page.
export const whatOf = (line) => (line.what ?? '').replace(/^consequence of (\w+)$/, (_, alarm) => fill(t.consequence, {alarm: changeName(alarm)}));

const columns = [{head: t.time, row: true, class: 'time'}, {head: t.kind}, {head: t.loop}, {head: t.what}, {head: t.change, class: 'change'}, {head: t.who},
  {head: t.result, class: 'words'}, {head: t.reason, class: 'words reason'}];
function lineRow(line) {
  const loop = line.loop ? el('a', {href: ownerHref(line.loop)}, ownerName(line.loop)) : '';
  const what = [line.alarm ? texts.alarms[line.alarm] ?? line.alarm : '', whatOf(line)].filter(Boolean).join(': ');
  return [wall().dateTime(line.utc_ms), t.kinds[line.kind] ?? line.kind, loop, what, changeOf(line), line.peer || t.daemon, line.result, line.reason];
}

// Returns the filter of the form as the server expects it.
function wishes(form) {
  const data = new FormData(form), ms = (name) => (data.get(name) ? wall().fromInput(data.get(name)) : '');
  return {text: data.get('text'), loop: data.get('loop'), kind: data.get('kind'), from_ms: ms('from'), to_ms: ms('to')};
}

export async function show(main, {options}, scope) {
  const select = (name, choices, value) => el('select', {name}, el('option', {value: ''}, t.any),
    choices.map(([key, text]) => el('option', {value: key, selected: key === value}, text)));
  const loops = [...(live.describe?.loops ?? []).map(({tag}) => tag), BOX].map((loop) => [loop, ownerName(loop)]);
  if (options.loop && !loops.some(([tag]) => tag === options.loop)) loops.push([options.loop, options.loop]);
  const csv = el('a', {class: 'button', download: 'journal.csv'}, t.csv);
  const form = el('form', {class: 'filters', role: 'search', submit: (event) => { event.preventDefault(); begin(); }, reset: () => setTimeout(begin)},
    field(t.search, el('input', {type: 'search', name: 'text', value: options.text})),
    field(t.loop, select('loop', loops, options.loop)),
    field(t.kind, select('kind', Object.entries(t.kinds), options.kind)),
    field(`${t.from} (${wall().zone})`, timeInput({name: 'from'})),
    field(`${t.to} (${wall().zone})`, timeInput({name: 'to'})),
    el('div', {class: 'buttons'}, el('button', {type: 'submit', class: 'main'}, t.apply), el('button', {type: 'reset'}, t.reset), csv));
  const list = el('div', {}, el('p', {class: 'nothing'}, texts.loading)), older = el('button', {hidden: true, click: () => more()}, t.older), trouble = el('p', {class: 'trouble', role: 'alert', hidden: true});
  main.append(el('h1', {tabindex: -1}, t.title), el('section', {class: 'panel'}, form), el('section', {class: 'panel'}, trouble, list, older));
  let lines = [], asked = 0;

  async function load(before_id) {
    const mine = ++asked, wish = wishes(form);
    csv.href = `/api/journal.csv${query(wish)}`;
    try {
      const answer = await get(`/api/journal${query({...wish, before_id, most: MOST})}`, scope.signal);
      if (mine !== asked) return;
      trouble.hidden = true;
      lines = before_id ? lines.concat(answer.lines) : answer.lines;
      older.hidden = answer.lines.length < MOST;
      list.replaceChildren(lines.length ? scroller(t.title, table(t.caption, columns, lines.map(lineRow), {captionHidden: true, class: 'lines as-cards journal'}))
        : el('p', {class: 'nothing'}, t.nothing));
    } catch (error) {
      if (error.name === 'AbortError') return;
      if (!lines.length) list.replaceChildren(el('p', {class: 'nothing'}, texts.notKnownNow));
      trouble.textContent = error.message;
      trouble.hidden = false;
    }
  }
  const begin = () => load();
  const more = () => load(lines.at(-1)?.id);
  await begin();
}
