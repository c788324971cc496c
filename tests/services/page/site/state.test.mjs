// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {FAULTS, MODES} from '../../../../services/page/site/lib/codes.js';
import {actsOf, modeOf, ne107Of, outageOf, outages, stateOf} from '../../../../services/page/site/lib/state.js';
import {texts} from '../../../../services/page/site/texts.js';

const calm = {pv: 5, sp: 5, co: 50, mode: 1, fault: 0, quality: 192, flags: 0, ne107: 0, alarm: 0, alarm_kind: null, condition: 95};
const overview = (change = {}) => Object.fromEntries(Object.entries({...calm, ...change}).map(([name, value]) => [name, [value]]));
const unknown = Object.fromEntries(Object.keys(calm).map((name) => [name, null]));
const about = {severe: 5, stale: false};
const words = (change, more = {}) => stateOf(overview(change), 0, {...about, ...more})[0];
const acts = (change, loop = {}, stale = false) => actsOf(overview(change), 0, loop, stale).key;
const GOOD = [texts.overview.calm, texts.acts.acts[0], texts.ne107.normal[1]];

test('a loop without a cycle is unknown, neither normal nor acting', () => {
  assert.equal(words({...unknown, alarm: 0}), texts.notKnown);
  assert.equal(acts(unknown), 'not_known');
  assert.deepEqual(ne107Of(overview(unknown), 0, false), ['–', texts.notKnown]);
});

test('old values are never shown as good', () => {
  const [said, sign, look] = stateOf(overview(), 0, {...about, stale: true});
  assert.match(said, /unknown/);
  assert.equal(words({stands: true}, {stale: true}), said, 'old values imply a stopped cycle');
  assert.deepEqual([sign, look], [null, 'soft']);
  assert.ok(!GOOD.includes(said));
  assert.equal(acts({}, {}, true), 'not_known');
  assert.equal(ne107Of(overview(), 0, true)[1], texts.notKnown);
});

test('a loop with a stopped cycle is never shown as good, and its alarm stays', () => {
  const standing = overview({stands: true});
  const [said, sign, look] = stateOf(standing, 0, about);
  assert.match(said, /no new values, last: normal/);
  assert.deepEqual([sign, look], ['bad', 'low']);
  assert.equal(acts({stands: true}), 'not_known');
  assert.equal(acts({stands: true}, {control: 'elsewhere'}), 'watched');
  assert.equal(modeOf(standing, 0, {}), null);
  assert.equal(ne107Of(standing, 0, false)[1], texts.notKnown);
  const alarmed = stateOf(overview({stands: true, alarm: 1, alarm_kind: 3}), 0, about);
  assert.match(alarmed[0], /Low air supply, unacknowledged/);
  assert.equal(alarmed[2], 'high waits');
});

test('a fault that only a newer daemon knows is shown, and the loop is not shown as acting', () => {
  assert.equal(acts({fault: 99}), 'not_known');
  assert.equal(words({fault: 99}), texts.faults.other);
  assert.equal(outageOf(overview({fault: 99}), 0), texts.faults.other);
});

test('loops that don’t work are listed with the reason, without loops in manual or with a faulty valve', () => {
  const columns = {...overview(), stands: [false]};
  const rows = [{}, {fault: FAULTS.indexOf('enable_open')}, {stands: true}, {fault: null}, {flags: 32}, {quality: 0}, {mode: 0}, {alarm: 1, alarm_kind: 0}, {fault: FAULTS.indexOf('starting')}, {stands: true, quality: 0}];
  const o = Object.fromEntries(Object.entries(columns).map(([name, [value]]) => [name, rows.map((row) => (name in row ? row[name] : value))]));
  assert.deepEqual(outages(o, rows.map((_, i) => ({tag: String(i)}))), [[texts.stale.loop, ['2', '9']], [texts.faults.enable_open, ['1']], [texts.notKnown, ['3']],
    [texts.flags.output_lost, ['4']], ['PV bad', ['5']]]);
});

test('a healthy loop is normal and acts', () => {
  assert.equal(words({}), texts.overview.calm);
  assert.equal(acts({}), 'acts');
  assert.equal(ne107Of(overview(), 0, false)[1], 'normal');
});

test('an output that does not reach the valve is never normal, however it is reported', () => {
  for (const change of [{fault: FAULTS.indexOf('output_lost')}, {fault: FAULTS.indexOf('output_unknown')}, {flags: 32}]) {
    assert.equal(acts(change), 'not_written', JSON.stringify(change));
    assert.equal(stateOf(overview(change), 0, about)[2], 'high', JSON.stringify(change));
  }
});

test('the reason that keeps a loop from acting has priority over its mode', () => {
  assert.equal(acts({fault: FAULTS.indexOf('enable_open'), mode: 1}), 'out_of_service');
  assert.equal(acts({fault: FAULTS.indexOf('stop')}), 'out_of_service');
  assert.equal(acts({mode: MODES.indexOf('manual')}), 'manual');
  assert.equal(acts({mode: MODES.indexOf('fallback')}), 'fallback');
  assert.equal(acts({mode: 99}), 'not_known');
  assert.equal(acts({}, {control: 'elsewhere'}), 'watched');
  assert.equal(words({}, {loop: {control: 'elsewhere'}}), texts.acts.watched[0]);
  assert.equal(actsOf(overview(), 0, {simulated: true}).simulated, true);
});

test('the mode of a watched loop is unknown while no data arrive from its controller', () => {
  assert.equal(modeOf(overview({quality: 0}), 0, {control: 'elsewhere'}), null);
  assert.equal(modeOf(overview(), 0, {control: 'elsewhere'}), 'automatic');
  assert.equal(modeOf(overview({quality: 0}), 0, {control: 'here'}), 'automatic');
  assert.equal(modeOf(overview({mode: 2}), 0, {control: 'elsewhere'}), 'other');
  assert.equal(modeOf(overview({mode: 2}), 0, {control: 'here'}), 'fallback');
});

test('every fault and mode has a complete text', () => {
  for (let fault = 0; fault <= FAULTS.length; ++fault) {
    for (let mode = 0; mode <= MODES.length; ++mode) {
      const {word, detail} = actsOf(overview({fault, mode}), 0, {});
      assert.ok(word.length && !/\{|undefined/.test(detail), `${fault} ${mode}: ${detail}`);
    }
  }
});

test('an alarm has size and severity from the list, otherwise from its kind', () => {
  const o = {alarm: 1, alarm_kind: 0};
  assert.match(words(o, {listed: () => ({alarm: 'stiction', severity_percent: 6.1})}), /Stiction 6\.1 %, unacknowledged/);
  assert.equal(stateOf(overview(o), 0, {...about, listed: () => ({alarm: 'stiction', severity_percent: 6.1})})[2], 'high waits');
  assert.equal(stateOf(overview(o), 0, about)[2], 'low waits');
});
