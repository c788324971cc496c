// SPDX-License-Identifier: Apache-2.0
// Curves of several loops: read from an address, grouped into panes by unit, on one axis of time. Pure.

export const QUANTITIES = ['pv', 'sp', 'co', 'stem'];
export const MOST_CURVES = 8;
const LANE_KEYS = ['c1', 'c2', 'c3', 'c4', 'c5', 'c6', 'c7', 'c8'];
const DASHES = [null, [7, 4], [2, 3], [9, 3, 2, 3]]; // to distinguish neighbours without colour

// Parses "FIC-101:pv,FIC-102:co" into [{tag, quantity}] without duplicates. Invalid curves are left out.
export function curvesIn(text) {
  const curves = [];
  for (const part of (text ?? '').split(',')) {
    const cut = part.lastIndexOf(':'), tag = part.slice(0, cut), quantity = part.slice(cut + 1);
    const double = curves.some((one) => one.tag === tag && one.quantity === quantity);
    if (cut > 0 && QUANTITIES.includes(quantity) && !double && curves.length < MOST_CURVES) curves.push({tag, quantity});
  }
  return curves;
}

export const curvesText = (curves) => curves.map(({tag, quantity}) => `${tag}:${quantity}`).join(',');

const ofPv = (quantity) => quantity === 'pv' || quantity === 'sp';

// Groups curves into the panes of a Trend: curves of one unit share a pane. `find(tag)`: the loop, or undefined; then its curves are left out.
export function panesOf(curves, find, nameOf) {
  const panes = [];
  curves.forEach(({tag, quantity}, i) => {
    const loop = find(tag);
    if (!loop) return;
    const unit = (ofPv(quantity) ? loop.pv_unit : loop.co_unit) ?? '', range = ofPv(quantity) ? loop.pv_range : loop.co_range;
    let pane = panes.find((one) => one.unit === unit);
    if (!pane) panes.push(pane = {label: unit, unit, range: [...range], curves: []});
    pane.range = [Math.min(pane.range[0], range[0]), Math.max(pane.range[1], range[1])];
    pane.label = [...new Set([...pane.curves.map((one) => one.name), nameOf(tag, quantity)])].join(', ');
    pane.curves.push({key: LANE_KEYS[i], name: nameOf(tag, quantity), ink: LANE_KEYS[i], dash: DASHES[i % DASHES.length], width: 1.6});
  });
  return panes;
}

// Joins `histories` (by tag) on one axis of all times, with a column for each curve. A cell is undefined if the loop has no row at that time.
// It is null if the row has no value, so that no line bridges the missing value.
export function joined(curves, histories) {
  const t = [...new Set(Object.values(histories).flatMap((history) => history.t))].sort((a, b) => a - b), data = {t};
  const places = Object.fromEntries(Object.entries(histories).map(([tag, history]) => [tag, new Map(history.t.map((at, row) => [at, row]))]));
  curves.forEach(({tag, quantity}, i) => {
    const column = histories[tag]?.[quantity], rows = places[tag];
    if (column) data[LANE_KEYS[i]] = t.map((at) => (rows.has(at) ? column[rows.get(at)] : undefined));
  });
  return data;
}
