// SPDX-License-Identifier: Apache-2.0
// Five condition indices of a control valve, from what a window of routine data shows. 100: as good as can
// be seen, 0: as bad as counts. They carry the names of Metso's Valve Manager (thesis, table 2.1), whose
// formulas are not published; these are this project's own and open.
//
//   index = 100 clamp(1 - worst of (value / limit), 0, 1)      over the values that are known
//
//   control performance   RMS of SP - PV, 5 % of the PV range. Can't know whether valve or tuning is to blame.
//   valve                 stick band, 10 % of the CO range. Can't know leakage, wear of packing and trim,
//                         cavitation.
//   actuator              lag of the stem behind CO, 30 s; an alarm on low air supply counts as its limit.
//                         Can't know diaphragm, spring, the pressure itself.
//   positioner            mean |CO - stem|, 3 % of the CO range; share of time with a bad read-back, 10 %.
//                         Can't know its self-tests.
//   environment           share of bad PV, 10 %; share of late cycles and lost output, 2 %. Can't know
//                         temperature, vibration, supply pressure.
//
// An index of which no value is known is NaN: not known, and not good.
// Limits: it is a worst case over measures, not a prediction of life.
//
// Source: names: Metso Valve Manager (thesis, section 2.2); formulas and limits: own.
#pragma once

#include <limits>

namespace loopwarden::analysis {

struct ConditionInputs {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double rms_error_percent = kUnknown;       // of the PV range
  double stick_percent = kUnknown;           // of the CO range
  double stem_lag_s = kUnknown;              // s, time constant of the stem behind CO
  double actuator_alarm = kUnknown;          // 1: low air supply or positioner overshoot
  double stem_deviation_percent = kUnknown;  // mean |CO - stem|, of the CO range
  double read_back_bad_share = kUnknown;     // 0 to 1
  double pv_bad_share = kUnknown;            // 0 to 1
  double cycle_bad_share = kUnknown;         // late cycles and lost outputs, 0 to 1
};

struct ConditionIndices {
  double control_performance = ConditionInputs::kUnknown;
  double valve = ConditionInputs::kUnknown;
  double actuator = ConditionInputs::kUnknown;
  double positioner = ConditionInputs::kUnknown;
  double environment = ConditionInputs::kUnknown;
};

ConditionIndices condition_indices(const ConditionInputs& in) noexcept;

}  // namespace loopwarden::analysis
