// SPDX-License-Identifier: Apache-2.0
// Requested reports on a loop's page: their time span and their state. Pure.
import {duration} from './format.js';

export const KINDS = ['gap', 'commission', 'survey', 'diagnose', 'receipt'];

const SECOND_MS = 1000;

// Returns the part of a trend's span that is recorded, between `oldest_ms` and `newest_ms`; null if no part is.
export function shown([from, to], {oldest_ms, newest_ms}) {
  if (!Number.isFinite(oldest_ms) || !Number.isFinite(newest_ms)) return null;
  const span = [Math.max(from, oldest_ms), Math.min(to, newest_ms)];
  return span[0] < span[1] ? span : null;
}

// A form has whole seconds. An end less than a second from the record's limit is set to that limit. The daemon reports larger errors.
export function sent([from, to], {oldest_ms, newest_ms}) {
  return [from < oldest_ms && oldest_ms - from < SECOND_MS ? oldest_ms : from, to > newest_ms && to - newest_ms < SECOND_MS ? newest_ms : to].map(Math.round);
}

// Returns the report's state as a key of the texts, with its values.
export function told(report, now_ms) {
  const {state} = report;
  if (state === 'waiting' && report.due_ms) return {key: 'due', values: {time: report.due_ms}};
  if (state === 'waiting') return {key: 'waiting', values: {place: report.place}};
  if (state !== 'running') return {key: state, values: {}};
  const long = duration(Math.max(0, now_ms - (report.started_ms ?? now_ms)) / 1000);
  return typeof report.percent === 'number' ? {key: 'doing', values: {long, what: report.doing, percent: report.percent}} : {key: 'running', values: {long}};
}

export const atWork = (reports) => reports.some((report) => report.state === 'running' || (report.state === 'waiting' && !report.due_ms));

// Returns the newest receipt of the loop, or null.
export const receiptOf = (reports) => reports.find((report) => report.kind === 'receipt') ?? null;
