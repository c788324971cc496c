// SPDX-License-Identifier: Apache-2.0
// The fleet's tables: which rows, in which order; what an alarm rate means; curves as paths. Pure.
import {byTag} from './order.js';

// Rows of which any text has each word; `textsOf(row)` gives its texts.
export function matching(rows, search, textsOf) {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  if (!words.length) return rows;
  return rows.filter((row) => {
    const text = textsOf(row).join('\n').toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

// By `value(row)`, a number or a text; what has none comes last either way, what is equal stays as it was.
export function sorted(rows, value, descending) {
  const turn = descending ? -1 : 1;
  return rows.map((row) => [value(row) ?? null, row]).sort(([a], [b]) => {
    if (a === null || b === null) return (a === null) - (b === null);
    return turn * (typeof a === 'number' ? a - b : byTag(String(a), String(b)));
  }).map(([, row]) => row);
}

// Against ISA-18.2: the key of a text, and how grave it is.
export function judged(rate, figures) {
  if (rate.flood_percent > figures.flood_percent) return ['floods', 'high'];
  if (rate.per_10_min > figures.most) return ['over', 'high'];
  return rate.per_10_min > figures.acceptable ? ['manageable', 'low'] : ['acceptable', null];
}

// The group whose last day is the least acceptable; null where all are.
export function worstOf(rates, figures) {
  const rank = (rate) => [null, 'low', 'high'].indexOf(judged(rate.day, figures)[1]);
  const [worst] = sorted(rates, (rate) => 1e6 * rank(rate) + rate.day.raised, true);
  return worst && rank(worst) > 0 ? worst : null;
}

// A value for each step as a path of level strokes, 0 at the bottom and `top` at 0; null is a gap.
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

// Upright bars of those numbers that `keep` takes, one wide each, 0 at the bottom and `top` at 0.
export function barPath(values, height, top, keep) {
  return values.map((n, i) => (n > 0 && keep(n) ? `M${i} ${height}V${Number((height * (1 - Math.min(n / top, 1))).toFixed(2))}h1V${height}z` : '')).join('');
}

// Null where nothing is known.
export function greatest(values) {
  const known = values.filter((value) => value !== null);
  return known.length ? Math.max(...known) : null;
}
