// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {KINDS, atWork, receiptOf, sent, shown, told} from '../../../../services/page/site/lib/asked.js';
import {duration} from '../../../../services/page/site/lib/format.js';
import {texts} from '../../../../services/page/site/texts.js';

const kept = {oldest_ms: 10_400, newest_ms: 90_700};

test('a report covers the part of the trend that is recorded', () => {
  assert.deepEqual(shown([20_000, 80_000], kept), [20_000, 80_000]);
  assert.deepEqual(shown([0, 100_000], kept), [10_400, 90_700]);
  assert.equal(shown([0, 10_000], kept), null);
  assert.equal(shown([0, 100_000], {oldest_ms: NaN, newest_ms: 90_700}), null);
});

test('whole seconds reach the ends of the record, and wrong times are left for the daemon to refuse', () => {
  assert.deepEqual(sent([10_000, 91_000], kept), [10_400, 90_700]);
  assert.deepEqual(sent([9_000, 95_000], kept), [9_000, 95_000]);
  assert.deepEqual(sent([20_000, 80_000], kept), [20_000, 80_000]);
});

test('a report shows its place in the queue, how long it has been in work, and on what', () => {
  assert.deepEqual(told({state: 'waiting', place: 3}, 0), {key: 'waiting', values: {place: 3}});
  assert.deepEqual(told({state: 'running', started_ms: 1000, percent: null}, 61_000), {key: 'running', values: {long: duration(60)}});
  assert.deepEqual(told({state: 'running', started_ms: 1000, doing: 'twin', percent: 0}, 61_000), {key: 'doing', values: {long: duration(60), what: 'twin', percent: 0}});
  assert.equal(told({state: 'running', started_ms: 99_000, percent: null}, 1000).values.long, told({state: 'running', started_ms: 1000, percent: null}, 1000).values.long);
  for (const state of ['done', 'failed']) assert.deepEqual(told({state}, 0), {key: state, values: {}});
});

test('the list is requested often while a report waits or is in work', () => {
  assert.equal(atWork([{state: 'done'}, {state: 'failed'}]), false);
  assert.equal(atWork([{state: 'done'}, {state: 'waiting'}]), true);
  assert.equal(atWork([{state: 'running'}]), true);
});

test('a receipt waits for the end of its record, and the newest one is shown', () => {
  const waits = {kind: 'receipt', state: 'waiting', place: null, due_ms: 7000}, done = {kind: 'receipt', state: 'done'};
  assert.deepEqual(told(waits, 0), {key: 'due', values: {time: 7000}});
  assert.equal(atWork([waits]), false);
  assert.equal(receiptOf([{kind: 'gap', state: 'done'}, waits, done]), waits);
  assert.equal(receiptOf([{kind: 'gap', state: 'done'}]), null);
});

test('every kind and state has a text', () => {
  for (const kind of KINDS) assert.ok(texts.asked.kinds[kind] && texts.asked.means[kind], kind);
  for (const key of ['waiting', 'due', 'running', 'doing', 'done', 'failed']) assert.ok(texts.asked.states[key], key);
});
