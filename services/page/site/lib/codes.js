// SPDX-License-Identifier: Apache-2.0
// Codes of the daemon, numbered as in its headers. Names here are keys of texts.js.

export const MODES = ['manual', 'automatic', 'fallback']; // control::Mode
export const FAULTS = ['none', 'starting', 'bad_pv', 'output_lost', 'late_cycle', 'not_finite', 'enable_open', 'stop',
  'output_unknown'];
export const ALARM_STATES = ['normal', 'unacknowledged', 'acknowledged', 'returned_unacknowledged',
  'latched_unacknowledged', 'latched_acknowledged', 'shelved', 'suppressed'];
const VALVE_ALARMS = ['stiction', 'backlash', 'hysteresis', 'low_air_supply', 'unknown', 'model_gap'];
const PROCESS_ALARMS = ['bad_pv', 'output_lost', 'output_unknown', 'not_normal_mode', 'enable_open', 'source_lost', 'deviation',
  'pv_high_high', 'pv_high', 'pv_low', 'pv_low_low', 'rate_of_change'];
export const ALARM_KINDS = [...VALVE_ALARMS, ...PROCESS_ALARMS];
// Only for these alarms a twin finds a cause and evidence is kept.
export const ofValve = (kind) => VALVE_ALARMS.includes(kind);
// An alarm of the box has this instead of a loop.
export const BOX = 'box';
export const NE107 = ['normal', 'maintenance_required', 'out_of_specification', 'function_check', 'failure'];
export const CONDITIONS = ['control_performance', 'valve', 'actuator', 'positioner', 'environment'];
export const FLAGS = {at_low: 1, at_high: 2, rate_limited: 4, late_cycle: 8, jacket_acts: 16, output_lost: 32,
  compensator_acts: 64};

// A code that only a newer daemon has is `other`; a missing one is `not_known`. Neither is shown as normal.
export const named = (names, code) => (typeof code === 'number' ? names[code] ?? 'other' : 'not_known');

// hal::Quality has the numbers of the OPC quality byte.
export function quality(code) {
  return code >= 192 ? 'good' : code >= 64 ? 'uncertain' : 'bad';
}

// States that wait for an operator.
const WAITS = new Set(['unacknowledged', 'returned_unacknowledged', 'latched_unacknowledged']);
export const waits = (state) => WAITS.has(state);
// States that an operator sees. A suppressed alarm is hidden, because it could not be raised.
export const shown = (state) => state !== 'normal' && state !== 'suppressed' && state !== 'not_known';

const ACTIONS = {
  unacknowledged: ['acknowledge', 'shelve'],
  acknowledged: ['shelve'],
  returned_unacknowledged: ['acknowledge', 'shelve'],
  latched_unacknowledged: ['acknowledge', 'shelve'],
  latched_acknowledged: ['reset', 'shelve'],
  shelved: ['unshelve'],
  normal: ['shelve'],
  suppressed: ['shelve'],
};
export const actionsOf = (state) => ACTIONS[state] ?? [];

// Two steps of urgency, as all alarms of one step need the same haste. 'high' needs action now. The daemon reports an alarm's
// priority. If only the alarm's name is known, its usual priority is used.
const ACTED_ON_NOW = new Set(['low_air_supply', 'bad_pv', 'output_lost', 'output_unknown', 'enable_open', 'pv_high_high', 'pv_low_low']);
export function priority(alarm, severe_percent) {
  if (alarm.priority ? ['high', 'critical'].includes(alarm.priority) : ACTED_ON_NOW.has(alarm.alarm)) return 'high';
  return typeof alarm.severity_percent === 'number' && alarm.severity_percent >= severe_percent ? 'high' : 'low';
}

export const PRIORITIES = ['critical', 'high', 'medium', 'low'];
// The box's alarms for a lost connection, which stand for the alarms of the loops behind it.
const OUTAGES = new Set(['connection_lost', 'feeder_lost']);
export const behindOutage = (alarm) => alarm.active && alarm.consequence && OUTAGES.has(alarm.consequence_of);
// States whose condition has cleared.
const CLEARED = new Set(['returned_unacknowledged', 'latched_unacknowledged', 'latched_acknowledged']);
export const cleared = (state) => CLEARED.has(state);

// The word next to the sign, by priority: critical and high `now`, medium `soon`, low `plan`. A severe valve fault is `shift`.
export const HASTES = ['now', 'shift', 'soon', 'plan'];
export function haste(alarm, severe_percent) {
  if (priority({...alarm, severity_percent: null}, severe_percent) === 'high') return 'now';
  if (priority(alarm, severe_percent) === 'high') return 'shift';
  return alarm.priority === 'medium' ? 'soon' : 'plan';
}
