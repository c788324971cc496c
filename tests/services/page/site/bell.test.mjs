// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {Bell} from '../../../../services/page/site/lib/bell.js';
import {tabIcon, tabTitle} from '../../../../services/page/site/lib/tab.js';

function rig(wish) {
  const kept = new Map(), heard = [], may = {sound: true};
  const memory = {recall: (key) => kept.get(key) ?? null, remember: (key, value) => (value === null ? kept.delete(key) : kept.set(key, value))};
  const bell = new Bell(memory, {sound: () => may.sound && heard.push('sound') > 0, notify: ({key}) => heard.push(key)});
  if (wish) bell.wish = wish;
  const take = (calls, now_ms) => { bell.take(calls, now_ms); return heard.splice(0); };
  return {bell, take, may};
}
const HIGH = {key: 'A', grave: 'high'}, LOW = {key: 'B', grave: 'low'};

test('a user who was not asked, or who declined, gets no sound', () => {
  const {bell, take} = rig();
  assert.equal(bell.asked, false);
  assert.deepEqual(take([HIGH, LOW], 0), []);
  bell.wish = 'off';
  assert.equal(bell.asked, true);
  assert.deepEqual(take([HIGH], 1000), []);
});

test('an alarm sounds until it is acknowledged, each ten seconds, and is notified once', () => {
  const {take} = rig('high');
  assert.deepEqual(take([HIGH], 0), ['A', 'sound']);
  assert.deepEqual(take([HIGH], 9999), []);
  assert.deepEqual(take([HIGH], 10_000), ['sound']);
  assert.deepEqual(take([], 11_000), []);
  assert.deepEqual(take([], 30_000), []);
  assert.deepEqual(take([HIGH], 31_000), ['A', 'sound'], 'it came again');
});

test('an alarm soon after a sound is notified immediately and waits for the next sound', () => {
  const {take} = rig('low');
  assert.deepEqual(take([LOW], 0), ['B', 'sound']);
  assert.deepEqual(take([LOW, HIGH], 2000), ['A']);
  assert.deepEqual(take([], 3000), []);
  assert.deepEqual(take([HIGH], 4000), ['A'], 'it flaps');
  assert.deepEqual(take([HIGH], 10_000), ['sound']);
  assert.deepEqual(take([HIGH], 1000), ['sound'], 'the clock of the computer was set back');
});

test('a sound that the browser blocks doesn’t count', () => {
  const {take, may} = rig('low');
  may.sound = false;
  assert.deepEqual(take([LOW], 0), ['B']);
  may.sound = true;
  assert.deepEqual(take([LOW], 1000), ['sound'], 'at once when it may');
});

test('sound and notification fail silently if the browser has neither', async () => {
  const {allowSound, maySound, notify, sound} = await import('../../../../services/page/site/lib/bell_sound.js');
  await allowSound();
  assert.equal(Boolean(maySound()), false);
  assert.equal(sound(), false);
  globalThis.Notification = class { static permission = 'granted'; constructor() { throw new TypeError('Illegal constructor'); } };
  notify({title: 'A', body: '', key: 'A', href: '#/'});
});

test('a browser allows sound after a click, and reports when it revokes that', async () => {
  const {allowSound, maySound, sound} = await import('../../../../services/page/site/lib/bell_sound.js');
  let tones = 0, told = 0;
  const part = () => ({frequency: {}, gain: {setValueAtTime() {}, exponentialRampToValueAtTime() {}}, connect: (to) => to, start: () => ++tones, stop() {}});
  globalThis.AudioContext = class extends EventTarget {
    state = 'suspended';
    currentTime = 0;
    resume() { this.set('running'); globalThis.AudioContext.newest = this; }
    set(state) { this.state = state; this.dispatchEvent(new Event('statechange')); }
    createOscillator = part;
    createGain = part;
  };
  await allowSound(() => ++told);
  assert.equal(sound(), true);
  assert.equal(tones, 2);
  globalThis.AudioContext.newest.set('interrupted');
  assert.equal(maySound(), false);
  assert.equal(sound(), false);
  assert.equal(told, 2);
});

test('only the chosen priorities sound', () => {
  assert.deepEqual(rig('high').take([LOW], 0), []);
  assert.deepEqual(rig('low').take([LOW, HIGH], 0), ['B', 'A', 'sound']);
});

test('silence has an end, and includes alarms raised meanwhile', () => {
  const {bell, take} = rig('low');
  bell.silence(60_000);
  assert.equal(bell.silentUntil(0), 60_000);
  assert.deepEqual(take([LOW], 0), []);
  assert.deepEqual(take([LOW, HIGH], 30_000), []);
  assert.equal(bell.silentUntil(60_000), null);
  assert.deepEqual(take([LOW, HIGH], 60_000), ['sound']);
  bell.silence(120_000);
  bell.silence(null);
  assert.deepEqual(take([LOW, HIGH], 70_000), ['sound']);
});

test('unknown alarms don’t sound, and sound again once they are known', () => {
  const {take} = rig('low');
  take([LOW], 0);
  assert.deepEqual(take(null, 1000), []);
  assert.deepEqual(take([LOW], 20_000), ['B', 'sound']);
});

test('the tab counts the waiting alarms, and shows missing values', () => {
  assert.equal(tabTitle('Alarms', 0, false), 'Alarms – Loopwarden');
  assert.equal(tabTitle('Alarms', 3, false), '(3) Alarms – Loopwarden');
  assert.equal(tabTitle('Alarms', 3, true), 'No values: Alarms – Loopwarden');
  assert.equal(tabIcon(0, 'low', false), '/icon.svg');
  assert.match(decodeURIComponent(tabIcon(3, 'low', false)), /#efb83f.*>3</);
  assert.match(decodeURIComponent(tabIcon(12, 'high', false)), /#f2564b.*>9\+</);
  assert.match(decodeURIComponent(tabIcon(3, 'high', true)), />×</);
});
