// SPDX-License-Identifier: Apache-2.0
// The fleet's tables: selection and order of rows, meaning of an alarm rate, curves as paths. Pure.
import {byTag} from './order.js';

// Returns the rows that contain each word in any of their texts; `textsOf(row)` returns a row's texts.
export function matching(rows, search, textsOf) {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  if (!words.length) return rows;
  return rows.filter((row) => {
    const text = textsOf(row).join('\n').toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

// Sorts by `value(row)`, a number or a text. Rows without a value are last in both directions. Equal rows keep their order.
export function sorted(rows, value, descending) {
  const turn = descending ? -1 : 1;
  return rows.map((row) => [value(row) ?? null, row]).sort(([a], [b]) => {
    if (a === null || b === null) return (a === null) - (b === null);
    return turn * (typeof a === 'number' ? a - b : byTag(String(a), String(b)));
  }).map(([, row]) => row);
}

// Returns the key of a text for a rate by ISA-18.2, and its severity.
export function judged(rate, figures) {
  if (rate.flood_percent > figures.flood_percent) return ['floods', 'high'];
  if (rate.per_10_min > figures.most) return ['over', 'high'];
  return rate.per_10_min > figures.acceptable ? ['manageable', 'low'] : ['acceptable', null];
}

// Returns the group with the least acceptable last day; null if all are acceptable.
export function worstOf(rates, figures) {
  const rank = (rate) => [null, 'low', 'high'].indexOf(judged(rate.day, figures)[1]);
  const [worst] = sorted(rates, (rate) => 1e6 * rank(rate) + rate.day.raised, true);
  return worst && rank(worst) > 0 ? worst : null;
}

// Draws a value for each step as a path of level strokes, with 0 at the bottom and `top` at 0; null is a gap.
export function curvePath(values, width, height, top) {
  const step = width / values.length;
  let path = '', pen = false;
  values.forEach((value, i) => {
    if (value === null) { pen = false; return; }
    const y = Number((height * (1 - Math.min(value / top, 1))).toFixed(2)), x = Number((i * step).toFixed(2));
    path += pen ? `V${y}` : `M${x} ${y}`;
    path += `H${Number(((i + 1) * step).toFixed(2))}`;
    pen = true;
  });
  return path;
}

// Draws upright bars, one unit wide, for the numbers that `keep` accepts; 0 is at the bottom and `top` at 0.
export function barPath(values, height, top, keep) {
  return values.map((n, i) => (n > 0 && keep(n) ? `M${i} ${height}V${Number((height * (1 - Math.min(n / top, 1))).toFixed(2))}h1V${height}z` : '')).join('');
}

// Null if no value is known.
export function greatest(values) {
  const known = values.filter((value) => value !== null);
  return known.length ? Math.max(...known) : null;
}
