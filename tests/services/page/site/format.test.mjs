// SPDX-License-Identifier: Apache-2.0
// Run by tests/services/page/site/run: node --test.
import assert from 'node:assert/strict';
import test from 'node:test';
import * as f from '../../../../services/page/site/lib/format.js';

// Returns the text with plain spaces.
const plain = (text) => text.replaceAll('\u00A0', ' ');

test('a counter is shown in its unit', () => {
  assert.equal(f.counter('bytes_sent', 1298500), '1.3\u00A0MB');
  assert.equal(f.counter('free_bytes', 512), '512\u00A0B');
  assert.equal(f.counter('requests', 12345), '12\u2009345');
  assert.equal(f.counter('share', 0.25), '0.25');
  assert.equal(f.counter('up', true), 'true');
});

test('decimals show a thousandth of the span', () => {
  assert.deepEqual([1, 0.5, 0.25, 0.2, 0.025, 100, 1e-9].map(f.decimalsOfStep), [0, 1, 2, 1, 3, 0, 6]);
  assert.equal(f.decimalsFor([0, 10]), 2);
  assert.equal(f.decimalsFor([0, 100]), 1);
  assert.equal(f.decimalsFor([-50, 50]), 1);
  assert.equal(f.decimalsFor([0, 16]), 1);
  assert.equal(f.decimalsFor([0, 16000]), 0);
  assert.equal(f.decimalsFor([0, 0.02]), 4);
  assert.equal(f.decimalsFor([5, 5]), 2);
  assert.equal(f.decimalsFor(undefined), 1);
});

test('a missing value is a dash, and zero has no sign', () => {
  for (const none of [null, undefined, NaN, Infinity, '7']) {
    assert.equal(f.fixed(none, 2), f.NONE);
    assert.equal(f.quantity(none, [0, 10], 'V'), f.NONE);
    assert.equal(f.percent(none), f.NONE);
    assert.equal(f.count(none), f.NONE);
    assert.equal(f.bytes(none), f.NONE);
    assert.equal(f.duration(none), f.NONE);
    assert.equal(f.significant(none), f.NONE);
  }
  assert.equal(f.fixed(-0.001, 2), '0.00');
  assert.equal(f.fixed(-0.006, 2), '-0.01');
});

test('quantities carry their unit', () => {
  assert.equal(plain(f.quantity(5.4321, [0, 10], 'L/min')), '5.43 L/min');
  assert.equal(plain(f.quantity(5.4321, [0, 10], '')), '5.43');
});

test('counts, bytes and microseconds', () => {
  assert.equal(f.count(1234567), '1\u2009234\u2009567');
  assert.equal(f.count(999), '999');
  assert.equal(plain(f.bytes(999)), '999 B');
  assert.equal(plain(f.bytes(76_032_000)), '76 MB');
  assert.equal(plain(f.bytes(1e15)), '1000 TB');
  assert.equal(plain(f.microseconds(64)), '64 µs');
  assert.equal(plain(f.microseconds(131072)), '131 ms');
});

test('durations are shown in their two greatest units', () => {
  assert.equal(plain(f.duration(0.84)), '0.84 s');
  assert.equal(plain(f.duration(59)), '59 s');
  assert.equal(plain(f.duration(60)), '1 min');
  assert.equal(plain(f.duration(312)), '5 min 12 s');
  assert.equal(plain(f.duration(3 * 86400 + 4 * 3600 + 59)), '3 d 4 h');
  assert.equal(plain(f.duration(86400 + 59)), '1 d');
});

test('wall-clock time of a zone, with its offset', () => {
  const clock = new f.WallClock('Africa/Johannesburg'), ms = Date.UTC(2026, 10, 24, 22, 30, 5, 250);
  assert.equal(clock.dateTime(ms), '2026-11-25 00:30:05');
  assert.equal(clock.offsetText(ms), 'UTC+02:00');
  assert.equal(clock.fine(ms, 10), '2026-11-25 00:30:05.250');
  assert.equal(clock.fine(ms, 500), '2026-11-25 00:30:05.2');
  assert.equal(clock.fine(ms, 60_000), '2026-11-25 00:30:05');
  assert.equal(clock.dateTime(null), f.NONE);
  assert.equal(new f.WallClock('America/St_Johns').offsetText(Date.UTC(2026, 0, 1)), 'UTC−03:30');
});

test('an entered time is in the same zone, before and after summer time begins', () => {
  const clock = new f.WallClock('Europe/Berlin');
  for (const text of ['2026-03-28 12:00:00', '2026-03-29 01:59:59', '2026-03-29 03:00:00', '2026-07-01 00:00:00', '2026-12-31 23:59:59']) {
    assert.equal(clock.toInput(clock.fromInput(text)), text);
  }
  assert.equal(clock.fromInput('2026-07-01T12:00'), Date.UTC(2026, 6, 1, 10));
  assert.equal(clock.fromInput('2026-07-01'), Date.UTC(2026, 5, 30, 22));
  assert.ok(Number.isNaN(clock.fromInput('nonsense')));
});

test('an unknown zone is replaced by UTC and shown as UTC', () => {
  assert.equal(new f.WallClock('Nowhere/At_All').zone, 'UTC');
  assert.equal(new f.WallClock('').dateTime(1000), '1970-01-01 00:00:01');
});
