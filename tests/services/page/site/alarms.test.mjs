// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import './document.mjs';

const {flapsText, notExplained} = await import('../../../../services/page/site/views/alarms.js');

test('an alarm that was raised once doesn’t flap, and a flapping one shows its count', () => {
  assert.equal(flapsText({flaps: 0}), null);
  assert.equal(flapsText({flaps: 1}), null);
  assert.match(flapsText({flaps: 3}), /^3 times, each within a minute after it cleared or while it was active$/);
});

test('for a loop without a twin the page doesn’t wait for an explanation', () => {
  assert.match(notExplained({twin: true}), /^The twin has not explained/);
  assert.match(notExplained(undefined), /^The twin has not explained/);
  assert.match(notExplained({twin: false}), /^This loop has no twin/);
});
