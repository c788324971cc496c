// SPDX-License-Identifier: Apache-2.0
// Gains of a loop, and the effect of other gains. Pure.
import {ofValve} from './codes.js';

export const GAINS = ['kp', 'ki', 'kd'];
export const sameGains = (a, b) => GAINS.every((name) => a[name] === b[name]);

// Returns the lines for the loop's file, with all digits. Derivative lines are included only if it is used, or if the file has one to change.
export const fileLines = (gains, file) => GAINS.filter((name) => name !== 'kd' || gains.kd !== 0 || file.kd !== 0).map((name) => `${name}: ${gains[name]}`);

// Integral time, s; null: no integral action.
export const integralTime = ({kp, ki}) => (ki > 0 ? kp / ki : null);

// "V/(L/min)", "V/(L/min s)", "V s/(L/min)": units of kp, ki, kd.
export function gainUnits(pv, co) {
  const below = pv || 'PV', above = co || 'CO', held = /[/ ]/.test(below) ? `(${below})` : below;
  return {kp: `${above}/${held}`, ki: `${above}/(${below} s)`, kd: `${above} s/${held}`};
}

// Returns the objections to settings: keys of texts.tuning.against.
export function against(trial, mostSensitivity) {
  if (!trial.stable) return ['unstable'];
  const found = [];
  if (!trial.settles) found.push('restless');
  if (trial.sensitivity === null || trial.sensitivity > mostSensitivity) found.push('margin');
  if (!trial.scales_with_gain) found.push('scale');
  return found;
}

// Returns the initial choice: the recommended rule, otherwise the first available one; null: no rule.
export const firstChoice = ({rules, recommended}) => recommended ?? (rules.length > 1 ? 1 : null);

// Active alarms of the loop's valve: with such an alarm no model is valid for the loop.
export const sickness = (alarms, tag) => alarms.filter((alarm) => alarm.loop === tag && alarm.active && ofValve(alarm.alarm)).map(({alarm}) => alarm);

// Returns whether an active alarm shows that the valve doesn't follow: gains can't correct it.
const STICKS = new Set(['stiction', 'backlash', 'hysteresis']);
export const sticks = (alarms, tag) => sickness(alarms, tag).some((alarm) => STICKS.has(alarm));

// Returns the columns of the trend: responses with the gains in force and with those of `chosen`.
export function answersOf({t, sp, rules}, chosen) {
  const now = rules[0], then = rules[chosen] ?? now;
  return {t, sp, pv_now: now.pv, co_now: now.co, pv: then.pv, co: then.co};
}
