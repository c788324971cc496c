// SPDX-License-Identifier: Apache-2.0
// The condensed state of NAMUR NE 107: one of five signals per loop. The box has the gravest of its
// loops.
//
//   failure                F  red     PV or output lost, or a result that is no number: the loop
//                                     can't control
//   function_check         C  orange  simulated or replayed; the operator has the loop in manual
//   out_of_specification   S  yellow  low air; another valve fault at or above `severe_percent`; PV
//                                     uncertain
//   maintenance_required   M  blue    a valve fault below that; a size that is not known counts as
//                                     0
//   normal                 N  green
//
// Gravest first: F > C > S > M > N. A shelved alarm still counts, because shelving repairs no
// fault.
//
// No errors.
// Limits: it can't weigh a loop's importance to the plant.
//
// Source: NAMUR recommendation NE 107 (2012), section 4.
#pragma once

#include <algorithm>
#include <cstdint>

#include "model/alarm/loop_alarms.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The register map uses these numbers. They never change. A greater number is graver.
enum class Ne107 : std::uint8_t {
  normal = 0,
  maintenance_required = 1,
  out_of_specification = 2,
  function_check = 3,
  failure = 4
};

constexpr const char* to_text(Ne107 state) noexcept {
  return numeric::enum_name<Ne107::failure>(
      state,
      {"normal", "maintenance_required", "out_of_specification", "function_check", "failure"});
}

struct LoopCondition {
  bool failed = false;
  bool simulated = false;
  bool manual = false;
  bool pv_uncertain = false;
};

constexpr Ne107 gravest(Ne107 a, Ne107 b) noexcept { return std::max(a, b); }

inline Ne107 condensed(const LoopCondition& loop, const LoopAlarms& alarms,
                       double severe_percent) noexcept {
  if (loop.failed) return Ne107::failure;
  if (loop.simulated || loop.manual) return Ne107::function_check;
  if (loop.pv_uncertain) return Ne107::out_of_specification;
  Ne107 state = Ne107::normal;
  // Process alarms are in `loop` already, without delay.
  for (const AlarmKind kind : kValveAlarms) {
    const Alarm& alarm = alarms.alarm(kind);
    if (!alarm.active()) continue;
    const bool severe =
        kind == AlarmKind::low_air_supply ||
        (!alarm.is_consequence() && alarm.memory().severity_percent >= severe_percent);
    state = gravest(state, severe ? Ne107::out_of_specification : Ne107::maintenance_required);
  }
  return state;
}

}  // namespace loopwarden::alarm
