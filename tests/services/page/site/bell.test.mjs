// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {Bell} from '../../../../services/page/site/lib/bell.js';
import {tabIcon, tabTitle} from '../../../../services/page/site/lib/tab.js';

function rig(wish) {
  const kept = new Map(), heard = [];
  const memory = {recall: (key) => kept.get(key) ?? null, remember: (key, value) => (value === null ? kept.delete(key) : kept.set(key, value))};
  const bell = new Bell(memory, {sound: () => heard.push('sound'), notify: ({key}) => heard.push(key)});
  if (wish) bell.wish = wish;
  const take = (calls, now_ms) => { bell.take(calls, now_ms); return heard.splice(0); };
  return {bell, take};
}
const HIGH = {key: 'A', grave: 'high'}, LOW = {key: 'B', grave: 'low'};

test('who was not asked, and who said no, hears nothing', () => {
  const {bell, take} = rig();
  assert.equal(bell.asked, false);
  assert.deepEqual(take([HIGH, LOW], 0), []);
  bell.wish = 'off';
  assert.equal(bell.asked, true);
  assert.deepEqual(take([HIGH], 1000), []);
});

test('an alarm sounds until it is acknowledged, each five seconds, and is notified once', () => {
  const {take} = rig('high');
  assert.deepEqual(take([HIGH], 0), ['A', 'sound']);
  assert.deepEqual(take([HIGH], 1000), []);
  assert.deepEqual(take([HIGH], 5000), ['sound']);
  assert.deepEqual(take([], 6000), []);
  assert.deepEqual(take([HIGH], 7000), ['A', 'sound'], 'it came again');
});

test('only the priorities that were asked for', () => {
  assert.deepEqual(rig('high').take([LOW], 0), []);
  assert.deepEqual(rig('low').take([LOW, HIGH], 0), ['B', 'A', 'sound']);
});

test('silence has an end, and lasts over what comes in it', () => {
  const {bell, take} = rig('low');
  bell.silence(60_000);
  assert.equal(bell.silentUntil(0), 60_000);
  assert.deepEqual(take([LOW], 0), []);
  assert.deepEqual(take([LOW, HIGH], 30_000), []);
  assert.equal(bell.silentUntil(60_000), null);
  assert.deepEqual(take([LOW, HIGH], 60_000), ['sound']);
  bell.silence(120_000);
  bell.silence(null);
  assert.deepEqual(take([LOW, HIGH], 66_000), ['sound']);
});

test('alarms that are not known are none, and come anew', () => {
  const {take} = rig('low');
  take([LOW], 0);
  assert.deepEqual(take(null, 1000), []);
  assert.deepEqual(take([LOW], 2000), ['B', 'sound']);
});

test('the tab counts what waits, and says where nothing is known', () => {
  assert.equal(tabTitle('Alarms', 0, false), 'Alarms – Loopwarden');
  assert.equal(tabTitle('Alarms', 3, false), '(3) Alarms – Loopwarden');
  assert.equal(tabTitle('Alarms', 3, true), 'No values: Alarms – Loopwarden');
  assert.equal(tabIcon(0, 'low', false), '/icon.svg');
  assert.match(decodeURIComponent(tabIcon(3, 'low', false)), /#efb83f.*>3</);
  assert.match(decodeURIComponent(tabIcon(12, 'high', false)), /#f2564b.*>9\+</);
  assert.match(decodeURIComponent(tabIcon(3, 'high', true)), />×</);
});
