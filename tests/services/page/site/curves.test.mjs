// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {MOST_CURVES, curvesIn, curvesText, joined, panesOf} from '../../../../services/page/site/lib/curves.js';
import {notesIn, notesOf, waitingStill, withWaiting} from '../../../../services/page/site/lib/notes.js';
import {SpanChoice} from '../../../../services/page/site/lib/span.js';

const LOOPS = {'FIC-101': {pv_unit: 'L/min', co_unit: 'V', pv_range: [0, 10], co_range: [0, 10]}, 'FIC-102': {pv_unit: 'L/min', co_unit: '%', pv_range: [0, 20], co_range: [0, 100]}};
const nameOf = (tag, quantity) => `${tag} ${quantity}`;

test('an address lists each valid curve once', () => {
  const curves = curvesIn('FIC-101:pv,FIC-102:co,FIC-101:pv,FIC-101:nonsense,:pv,x');
  assert.deepEqual(curves, [{tag: 'FIC-101', quantity: 'pv'}, {tag: 'FIC-102', quantity: 'co'}]);
  assert.deepEqual(curvesIn(curvesText(curves)), curves);
  assert.deepEqual(curvesIn(undefined), []);
  assert.equal(curvesIn(Array.from({length: 20}, (_, i) => `L${i}:pv`).join()).length, MOST_CURVES);
});

test('curves of one unit share a pane and its widest range, and curves of a missing loop are left out', () => {
  const panes = panesOf(curvesIn('FIC-101:pv,FIC-102:sp,FIC-102:co,GONE:pv'), (tag) => LOOPS[tag], nameOf);
  assert.deepEqual(panes.map(({unit, range, curves}) => [unit, range, curves.map(({name}) => name)]),
    [['L/min', [0, 20], ['FIC-101 pv', 'FIC-102 sp']], ['%', [0, 100], ['FIC-102 co']]]);
  const looks = panes.flatMap(({curves}) => curves.map(({ink}) => ink));
  assert.equal(new Set(looks).size, 3, 'no two of one colour');
});

test('on the joined axis a loop has no row at the times of another, and a gap stays a gap', () => {
  const data = joined(curvesIn('A:pv,B:pv'), {A: {t: [1, 3, 5], pv: [10, null, 30]}, B: {t: [2, 3], pv: [7, 8]}});
  assert.deepEqual(data.t, [1, 2, 3, 5]);
  assert.deepEqual(data.c1, [10, undefined, null, 30]);
  assert.deepEqual(data.c2, [undefined, 7, 8, undefined]);
});

test('notes have author, time of writing and the time they refer to, in its order', () => {
  const line = (utc_ms, more) => ({what: 'note', result: 'done', kind: 'operator', loop: 'A', utc_ms, new: '', peer: 'anna@10.0.0.5 by page (uid 997)', reason: 'words', ...more});
  const notes = notesOf([line(9000), line(8000, {new: '1970-01-01T00:00:02Z'}), {...line(7000), what: 'outcome'}]);
  assert.deepEqual(notes.map(({number, at_ms, said_ms, who, text}) => [number, at_ms, said_ms, who, text]), [[1, 2000, 8000, 'anna@10.0.0.5', 'words'], [2, 9000, 9000, 'anna@10.0.0.5', 'words']]);
  assert.deepEqual(notesIn(notes, [0, 3000]).map(({number}) => number), [1]);
});

test('a span follows, is fixed, returns, and is stored in the address', () => {
  const choice = SpanChoice.of({});
  assert.deepEqual(choice.span(1_000_000, 0), [400_000, 1_000_000]);
  choice.want([100, 200]);
  assert.deepEqual(choice.span(1_000_000, 0), [100, 200]);
  assert.deepEqual(choice.address, {from: 100, to: 200});
  assert.deepEqual(SpanChoice.of({from: '100', to: '200'}).fixed, [100, 200]);
  choice.want([120, 150]);
  choice.want(null);
  assert.deepEqual(choice.span(1_000_000, 0), [100, 200]);
  choice.want('all');
  assert.deepEqual(choice.span(1_000_000, 5000), [5000, 1_000_000]);
  assert.deepEqual(SpanChoice.of(choice.address).span_s, 0);
  for (const wrong of [{from: '9', to: '3'}, {span: '7'}, {from: 'x'}]) assert.equal(SpanChoice.of(wrong).span_s, 600, JSON.stringify(wrong));
});

test('a note that the journal has not written yet is marked, at its place, until a line contains it', () => {
  const line = {loop: 'A', what: 'note', result: 'done', new: '', peer: 'otto', reason: 'one', utc_ms: 5000}, waiting = [{loop: 'A', at_ms: 2000, said_ms: 9000, who: 'otto', text: 'two'}];
  const both = withWaiting(notesOf([line]), waiting);
  assert.deepEqual(both.map(({number, text, on_disk}) => [number, text, on_disk]), [[1, 'two', false], [2, 'one', undefined]]);
  const written = notesOf([line, {...line, reason: 'two', utc_ms: 9000, new: '1970-01-01T00:00:02Z'}]);
  assert.deepEqual(waitingStill(written, waiting), []);
  assert.equal(withWaiting(written, waiting), written);
  assert.equal(waitingStill(notesOf([{...line, reason: 'two', utc_ms: 2000, loop: 'B'}]), waiting).length, 1, 'another loop’s');
});
