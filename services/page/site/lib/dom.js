// SPDX-License-Identifier: Apache-2.0
// Makes elements. All text is inserted as text, never as markup: tags, reasons and names may contain anything.

const SVG = 'http://www.w3.org/2000/svg';

function put(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === 'function') node.addEventListener(name, value);
    else node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

// el('button', {class: 'plain', click: act}, 'text', node, [nodes])
export const el = (name, attributes, ...children) => put(document.createElement(name), attributes, children);
export const svg = (name, attributes, ...children) => put(document.createElementNS(SVG, name), attributes, children);

// Makes a sign from the sheet in index.html. Without a label it is an ornament next to text of the same meaning.
export function icon(name, label) {
  const use = svg('use', {href: `#i-${name}`});
  return svg('svg', {class: `icon icon-${name}`, viewBox: '0 0 16 16', ...(label ? {role: 'img', 'aria-label': label} : {'aria-hidden': 'true'})}, use);
}

export function setText(node, text) {
  if (node.shown === text) return;
  node.shown = text;
  node.textContent = text;
}

export function setAttribute(node, name, value) {
  if (value === null || value === false) { if (node.hasAttribute(name)) node.removeAttribute(name); }
  else if (node.getAttribute(name) !== value) node.setAttribute(name, value);
}

// columns: [{head, class, row: its cells are the rows' heads}]; rows: arrays of text or nodes. The roles are explicit and each cell names its
// head, because a phone shows the rows of some tables as cards.
export function table(caption, columns, rows, {captionHidden = false, ...attributes} = {}) {
  const cell = (value, i) => {
    const {row, head} = columns[i];
    return el(row ? 'th' : 'td', {class: columns[i].class, scope: row ? 'row' : null, role: row ? 'rowheader' : 'cell', 'data-head': head || null}, ...[value ?? ''].flat());
  };
  return el('table', {role: 'table', ...attributes},
    el('caption', {class: captionHidden ? 'unseen' : null}, caption),
    el('thead', {role: 'rowgroup'}, el('tr', {role: 'row'}, columns.map((column) => el('th', {scope: 'col', role: 'columnheader', class: column.class}, column.head)))),
    el('tbody', {role: 'rowgroup'}, rows.map((row) => el('tr', {role: 'row'}, row.map(cell)))));
}

// A table that may be wider than the page: it scrolls separately, also by keys.
export const scroller = (label, child) => el('div', {class: 'scroller', tabindex: 0, role: 'region', 'aria-label': label}, child);

// A panel that is folded on a phone, so that rarely needed content doesn't displace the rest.
export function foldingPanel(title, ...what) {
  return el('details', {class: 'panel folding', open: !matchMedia('(max-width: 700px)').matches}, el('summary', {}, el('h2', {}, title)), what);
}

// A time as the whole page writes it, whatever the browser's language.
const TIME = String.raw`\d{4}-\d{2}-\d{2}([T ]\d{2}:\d{2}(:\d{2})?)?`;
export const timeInput = (attributes) => el('input', {type: 'text', class: 'time', inputmode: 'numeric', autocomplete: 'off', placeholder: 'YYYY-MM-DD hh:mm', pattern: TIME, title: 'YYYY-MM-DD hh:mm:ss', ...attributes});

export const unseen = (text) => el('span', {class: 'unseen'}, text);
export const unit = (text) => (text ? el('span', {class: 'unit', title: text}, text) : null);

// Makes a list of {name: [term, description]} pairs.
export const facts = (pairs) => el('dl', {class: 'facts'},
  pairs.filter(Boolean).map(([term, ...what]) => el('div', {}, el('dt', {}, term), el('dd', {}, what))));
