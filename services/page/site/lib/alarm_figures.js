// SPDX-License-Identifier: Apache-2.0
// Compares the figures of an alarm system with the targets of ISA-18.2 for one operator. Pure.

// Targets of the standard; `top_percent`: share of all raised alarms.
export const TARGETS = {per_hour: 6, most_in_10_min: 10, flood_percent: 1, chattering: 0, stale: 5, top_percent: 5};

// Returns [key, value, whether it meets its target] for the daemon's answer. The last is null for a share if there are too few alarms to judge it.
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

// Whether the journal covers less than the requested time.
export const reachesLess = (answer, hours) => answer.to_ms - answer.from_ms < 3_600_000 * hours - 1000;
