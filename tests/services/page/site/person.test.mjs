// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {Person} from '../../../../services/page/site/lib/person.js';

const MARK = {'X-Loopwarden-Person': '1'};

test('requests carry the mark of a user for a minute after a key or a pointer', () => {
  const person = new Person();
  assert.deepEqual(person.headers(0), {});
  person.seen(1000);
  assert.deepEqual(person.headers(1000), MARK);
  assert.deepEqual(person.headers(60_999), MARK);
  assert.deepEqual(person.headers(61_000), {});
});

test('a user in a view without requests is reported now and then, until the user leaves', () => {
  const person = new Person();
  assert.equal(person.isUntold(0), false);
  person.seen(0);
  assert.equal(person.isUntold(1), true);
  person.headers(1);
  assert.equal(person.isUntold(2), false);
  assert.equal(person.isUntold(30_000), true);
  assert.equal(person.isUntold(60_000), false);
});

test('a key and a pressed or moved pointer show that a user is present', () => {
  for (const sign of ['keydown', 'pointerdown', 'pointermove', 'wheel']) {
    const person = new Person(), target = new EventTarget();
    person.watch(target);
    assert.equal(person.isHere(performance.now()), false);
    target.dispatchEvent(new Event(sign));
    assert.equal(person.isHere(performance.now()), true, sign);
  }
});
