// SPDX-License-Identifier: Apache-2.0
// A table that is sorted by clicks on its heads. Its roles are explicit, because a phone no longer lays out its rows as a table. Updates keep scroll position and focus.
import {el, scroller, setAttribute} from './dom.js';
import {sorted} from './fleet.js';

export class SortedTable {
  // columns: [{key, head, class, row (is the row's head), value(row), cell(row), falls (sorts the greatest first)}];
  // a column without `value` does not sort. keyOf(row): the same row in the next answer.
  constructor(label, columns, keyOf, sort, attributes = {class: 'lines as-cards'}) {
    Object.assign(this, {columns, keyOf, sort, falls: columns.find((column) => column.key === sort)?.falls ?? false, rows: []});
    this.heads = columns.map((column) => this.#head(column));
    this.body = el('tbody', {role: 'rowgroup'});
    this.node = scroller(label, el('table', {role: 'table', ...attributes}, el('caption', {class: 'unseen'}, label), el('thead', {role: 'rowgroup'}, el('tr', {role: 'row'}, this.heads)), this.body));
    this.#mark();
  }

  #head(column) {
    if (!column.value) return el('th', {scope: 'col', role: 'columnheader', class: column.class}, column.head);
    return el('th', {scope: 'col', role: 'columnheader', class: column.class}, el('button', {type: 'button', class: 'sort', click: () => this.#by(column)},
      column.head, el('span', {class: 'arrow', 'aria-hidden': 'true'})));
  }

  #by(column) {
    this.falls = this.sort === column.key ? !this.falls : column.falls ?? false;
    this.sort = column.key;
    this.#mark();
    this.show(this.rows);
  }

  #mark() {
    this.columns.forEach(({key}, i) => setAttribute(this.heads[i], 'aria-sort', key === this.sort ? (this.falls ? 'descending' : 'ascending') : null));
  }

  show(rows) {
    this.rows = rows;
    const held = this.body.contains(document.activeElement) ? document.activeElement.closest('tr').dataset.key : null;
    const column = this.columns.find(({key}) => key === this.sort);
    this.body.replaceChildren(...sorted(rows, column.value, this.falls).map((row) => this.#row(row)));
    if (held) [...this.body.children].find((row) => row.dataset.key === held)?.querySelector('a')?.focus({preventScroll: true});
  }

  #row(row) {
    return el('tr', {role: 'row', 'data-key': this.keyOf(row)}, this.columns.map((column) =>
      el(column.row ? 'th' : 'td', {class: column.class, scope: column.row ? 'row' : null, role: column.row ? 'rowheader' : 'cell', 'data-head': column.head}, ...[column.cell(row) ?? ''].flat())));
  }
}
