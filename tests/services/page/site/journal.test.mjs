// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import './document.mjs';

const {changeOf, whatOf} = await import('../../../../services/page/site/views/journal.js');

const line = (more) => ({from: '', to: '', old: '', new: '', what: '', severity_percent: null, ...more});

test('an alarm whose state stays is not shown as a change', () => {
  assert.equal(changeOf(line({from: 'normal', to: 'unacknowledged'})), 'normal → unacknowledged');
  assert.equal(changeOf(line({from: 'suppressed', to: 'suppressed'})), 'suppressed');
});

test('alarms in a line have the same names as everywhere on the page', () => {
  assert.equal(whatOf(line({what: 'consequence of bad_pv'})), 'consequence of PV bad');
  assert.equal(changeOf(line({what: 'incident renamed', old: 'no_longer_as_commissioned', new: 'stiction'})), 'No longer as commissioned → Stiction');
  assert.equal(changeOf(line({what: 'incident joined', new: 'stiction'})), '– → Stiction');
});

test('texts of others stay unchanged', () => {
  assert.equal(whatOf(line({what: 'set point'})), 'set point');
  assert.equal(whatOf({}), '');
  assert.equal(changeOf(line({what: 'mode', old: 'MAN', new: 'AUTO'})), 'MAN → AUTO');
});
