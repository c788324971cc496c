// SPDX-License-Identifier: Apache-2.0
// The figures of an alarm system against the targets of ISA-18.2 for one operator. Pure.

// What the standard bears; `top_percent`: of all alarms that came.
export const TARGETS = {per_hour: 6, most_in_10_min: 10, flood_percent: 1, chattering: 0, stale: 5, top_percent: 5};

// [key, value, whether it is as it should be] of the daemon's answer. With too few alarms to judge by a share, shares are not judged: null.
const FEW = 100;
export function figuresOf(answer) {
  const {top, came} = answer, most = top.length ? Math.max(...top.map(({percent}) => percent)) : null;
  return [
    ['came', came, null],
    ['per_hour', answer.per_hour, answer.per_hour <= TARGETS.per_hour],
    ['most_in_10_min', answer.most_in_10_min, answer.most_in_10_min <= TARGETS.most_in_10_min],
    ['floods', answer.floods, null],
    ['flood_percent', answer.flood_percent, answer.flood_percent < TARGETS.flood_percent],
    ['chattering', answer.chattering.length, answer.chattering.length <= TARGETS.chattering],
    ['stale', answer.stale.length, answer.stale.length < TARGETS.stale],
    ['top_percent', most, most === null || came < FEW ? null : most < TARGETS.top_percent],
  ];
}

// Whether the journal reaches back less than was asked for.
export const reachesLess = (answer, hours) => answer.to_ms - answer.from_ms < 3_600_000 * hours - 1000;
