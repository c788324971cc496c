// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import './document.mjs';
import {against, answersOf, fileLines, firstChoice, gainUnits, integralTime, sameGains, sickness} from '../../../../services/page/site/lib/tuning.js';

const {live} = await import('../../../../services/page/site/lib/live.js');
const {tuningPart} = await import('../../../../services/page/site/views/tuning.js');

const none = {kp: 1, ki: 0, kd: 0};

test('the lines to paste have all digits, and the derivative only if it exists or must change', () => {
  assert.deepEqual(fileLines({kp: 0.1 + 0.2, ki: 0.05, kd: 0}, none), ['kp: 0.30000000000000004', 'ki: 0.05']);
  assert.deepEqual(fileLines({kp: 1, ki: 0.05, kd: 2}, none), ['kp: 1', 'ki: 0.05', 'kd: 2']);
  assert.deepEqual(fileLines({kp: 1, ki: 0.05, kd: 0}, {...none, kd: 3}), ['kp: 1', 'ki: 0.05', 'kd: 0']);
});

test('gains are equal if all three are', () => {
  assert.ok(sameGains(none, {...none}));
  for (const name of ['kp', 'ki', 'kd']) assert.ok(!sameGains(none, {...none, [name]: 9}));
});

test('a unit that is a quotient is in brackets', () => {
  assert.deepEqual(gainUnits('L/min', 'V'), {kp: 'V/(L/min)', ki: 'V/(L/min s)', kd: 'V s/(L/min)'});
  assert.equal(gainUnits('bar', '%').kp, '%/bar');
  assert.equal(gainUnits('', '').kp, 'CO/PV');
});

test('without integral action there is no integral time', () => {
  assert.equal(integralTime({kp: 2, ki: 0.5}), 4);
  assert.equal(integralTime(none), null);
});

const trial = (more) => ({stable: true, settles: true, sensitivity: 1.6, scales_with_gain: true, ...more});

test('objections to settings are shown, and for unstable settings only that', () => {
  assert.deepEqual(against(trial(), 2), []);
  assert.deepEqual(against(trial({sensitivity: 2.1, settles: false}), 2), ['restless', 'margin']);
  assert.deepEqual(against(trial({sensitivity: null}), 2), ['margin']);
  assert.deepEqual(against(trial({scales_with_gain: false}), 2), ['scale']);
  assert.deepEqual(against(trial({stable: false, settles: false}), 2), ['unstable']);
});

test('the recommended rule is chosen first, otherwise the first one, otherwise null', () => {
  assert.equal(firstChoice({rules: [1, 2, 3], recommended: 2}), 2);
  assert.equal(firstChoice({rules: [1, 2, 3], recommended: null}), 1);
  assert.equal(firstChoice({rules: [1], recommended: null}), null);
});

test('the trend has the responses with today’s gains and with the chosen rule', () => {
  const answer = {t: [0, 1], sp: [5, 6], rules: [{pv: [5, 5], co: [1, 1]}, {pv: [5, 6], co: [1, 2]}]};
  assert.deepEqual(answersOf(answer, 1), {t: [0, 1], sp: [5, 6], pv_now: [5, 5], co_now: [1, 1], pv: [5, 6], co: [1, 2]});
  assert.deepEqual(answersOf(answer, 7).pv, [5, 5]);
});

test('active alarms of the loop’s valve are an objection to tuning, and no others', () => {
  const alarm = (more) => ({loop: 'FIC-101', alarm: 'stiction', active: true, ...more});
  assert.deepEqual(sickness([alarm(), alarm({alarm: 'model_gap'})], 'FIC-101'), ['stiction', 'model_gap']);
  assert.deepEqual(sickness([alarm({active: false}), alarm({loop: 'FIC-102'}), alarm({alarm: 'deviation'})], 'FIC-101'), []);
});

test('gains that can’t be read after a command are shown as unknown, until they are read again', async () => {
  live.session = {};
  const scope = {signal: undefined}, loop = {tag: 'FIC-101', pv_unit: 'L/min', co_unit: 'V'}, gains = {in_force: none, file: none, not_in_file: false};
  const part = tuningPart(loop, scope, null), words = (node) => (typeof node === 'object' ? node.children.map(words).join(' ') || node.textContent || '' : String(node));
  part.show(gains);
  assert.match(words(part.node), /Integral time/);
  globalThis.fetch = async () => ({ok: false, status: 503, headers: new Headers(), json: async () => ({error: 'the daemon is away'})});
  await part.refresh();
  assert.match(words(part.node), /the daemon is away/);
  part.show(gains);
  assert.match(words(part.node), /Integral time/);
  assert.doesNotMatch(words(part.node), /away/);
});
