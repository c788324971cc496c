// SPDX-License-Identifier: Apache-2.0
import {el, scroller, table, unseen} from '../lib/dom.js';
import {bytes} from '../lib/format.js';
import {get, query} from '../lib/api.js';
import {wall} from '../lib/shell.js';
import {texts} from '../texts.js';

const t = texts.reports;

export const reportHref = (id) => `/reports/${id.split('/').map(encodeURIComponent).join('/')}`;

// Returns the twin's report on a piece of evidence, or null.
export async function reportOf(evidence, signal) {
  try {
    return (await get(`/api/reports${query({evidence})}`, signal))[0] ?? null;
  } catch {
    return null;
  }
}

function rowOf(report) {
  const link = el('a', {href: reportHref(report.id), target: '_blank', rel: 'noopener'}, report.title || report.id, unseen(` (${t.opens})`));
  return [link, t.kinds[report.kind] ?? report.kind, report.loop ? el('a', {href: `#/loop/${encodeURIComponent(report.loop)}`}, report.loop) : '',
    wall().dateTime(report.utc_ms), bytes(report.bytes)];
}

export async function show(main, _, scope) {
  main.append(el('h1', {tabindex: -1}, t.title), el('p', {class: 'nothing'}, texts.loading));
  const reports = await get('/api/reports', scope.signal), kinds = [...new Set(reports.map((report) => report.kind))];
  const list = el('div', {});
  const columns = [{head: t.name, row: true}, {head: t.kind}, {head: t.loop}, {head: t.made}, {head: t.size, class: 'number'}];
  const fillList = (kind) => {
    const chosen = reports.filter((report) => !kind || report.kind === kind);
    list.replaceChildren(chosen.length ? scroller(t.title, table(t.caption, columns, chosen.map(rowOf), {captionHidden: true, class: 'lines as-cards titles'}))
      : el('p', {class: 'nothing'}, t.nothing));
  };
  const filter = el('select', {'aria-label': t.filter, change: () => fillList(filter.value)}, el('option', {value: ''}, t.all),
    kinds.map((kind) => el('option', {value: kind}, t.kinds[kind] ?? kind)));
  main.replaceChildren(el('div', {class: 'title'}, el('h1', {tabindex: -1}, t.title), el('span', {class: 'stretch'}), reports.length ? filter : null), el('section', {class: 'panel'}, list));
  fillList('');
}
