// SPDX-License-Identifier: Apache-2.0
// Reports that are asked for on a loop's page: over which time, and what has become of one. Pure.
import {duration} from './format.js';

export const KINDS = ['gap', 'commission', 'survey', 'diagnose'];

const SECOND_MS = 1000;

// What a trend shows, of what is recorded: nothing before `oldest_ms`, nothing after `newest_ms`; null where nothing is left.
export function shown([from, to], {oldest_ms, newest_ms}) {
  if (!Number.isFinite(oldest_ms) || !Number.isFinite(newest_ms)) return null;
  const span = [Math.max(from, oldest_ms), Math.min(to, newest_ms)];
  return span[0] < span[1] ? span : null;
}

// A form knows whole seconds: within one, an end is that of what is recorded. Beyond that the daemon says what is wrong.
export function sent([from, to], {oldest_ms, newest_ms}) {
  return [from < oldest_ms && oldest_ms - from < SECOND_MS ? oldest_ms : from, to > newest_ms && to - newest_ms < SECOND_MS ? newest_ms : to].map(Math.round);
}

// Its state as a name in the texts, with what belongs there.
export function told(report, now_ms) {
  const {state} = report;
  if (state === 'waiting') return {key: 'waiting', values: {place: report.place}};
  if (state !== 'running') return {key: state, values: {}};
  const long = duration(Math.max(0, now_ms - (report.started_ms ?? now_ms)) / 1000);
  return typeof report.percent === 'number' ? {key: 'doing', values: {long, what: report.doing, percent: report.percent}} : {key: 'running', values: {long}};
}

export const atWork = (reports) => reports.some((report) => report.state === 'running' || report.state === 'waiting');
