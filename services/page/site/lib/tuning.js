// SPDX-License-Identifier: Apache-2.0
// Gains of a loop, and what others would do. Pure.
import {ofValve} from './codes.js';

export const GAINS = ['kp', 'ki', 'kd'];
export const sameGains = (a, b) => GAINS.every((name) => a[name] === b[name]);

// The lines of the loop's file, all digits; of the derivative only where there is one, or the file has one to change.
export const fileLines = (gains, file) => GAINS.filter((name) => name !== 'kd' || gains.kd !== 0 || file.kd !== 0).map((name) => `${name}: ${gains[name]}`);

// Integral time, s; null: no integral action.
export const integralTime = ({kp, ki}) => (ki > 0 ? kp / ki : null);

// "V/(L/min)", "V/(L/min s)", "V s/(L/min)": of kp, ki, kd.
export function gainUnits(pv, co) {
  const below = pv || 'PV', above = co || 'CO', held = /[/ ]/.test(below) ? `(${below})` : below;
  return {kp: `${above}/${held}`, ki: `${above}/(${below} s)`, kd: `${above} s/${held}`};
}

// What speaks against settings: keys of texts.tuning.against.
export function against(trial, mostSensitivity) {
  if (!trial.stable) return ['unstable'];
  const found = [];
  if (!trial.settles) found.push('restless');
  if (trial.sensitivity === null || trial.sensitivity > mostSensitivity) found.push('margin');
  if (!trial.scales_with_gain) found.push('scale');
  return found;
}

// What is chosen first: the recommended rule, else the first that there is; null: none.
export const firstChoice = ({rules, recommended}) => recommended ?? (rules.length > 1 ? 1 : null);

// Alarms of the loop's valve that are on: of such a loop no model speaks.
export const sickness = (alarms, tag) => alarms.filter((alarm) => alarm.loop === tag && alarm.active && ofValve(alarm.alarm)).map(({alarm}) => alarm);

// Columns of the trend: answers with the gains in force and with those of `chosen`.
export function answersOf({t, sp, rules}, chosen) {
  const now = rules[0], then = rules[chosen] ?? now;
  return {t, sp, pv_now: now.pv, co_now: now.co, pv: then.pv, co: then.co};
}
