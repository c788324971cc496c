// SPDX-License-Identifier: Apache-2.0
// Five condition indices of a control valve from a window of routine data, 0 to 100. 100 is the
// best visible condition; 0 means that a value has reached its limit. The names are those of
// Metso's Valve Manager (thesis, table 2.1), whose formulas are not published; the formulas here
// are the project's.
//
//   index = 100 clamp(1 - worst of (value / limit), 0, 1)      over the known values
//
//   index                 values and limits                         not visible
//   control performance   RMS of SP - PV, 5 % of the PV range       valve or tuning as the cause
//   valve                 stick band, 10 % of the CO range          leakage, wear of packing and
//                                                                   trim, cavitation
//   actuator              lag of the stem after CO, 30 s; an        diaphragm, spring, the pressure
//                         alarm on low air supply is the limit
//   positioner            mean |CO - stem|, 3 % of the CO range;    its self-tests
//                         share of bad read-backs, 10 % of time
//   environment           share of bad PV, 10 %; share of late      temperature, vibration, supply
//                         cycles and lost output, 2 %               pressure
//
// An index without any known value is NaN, which means unknown, not good.
// Limits: the index is a worst case over measures, not a prediction of life.
//
// Source: names: Metso Valve Manager (thesis, section 2.2); formulas and limits: own.
#pragma once

#include <limits>

namespace loopwarden::analysis {

struct ConditionInputs {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double rms_error_percent = kUnknown;       // of the PV range
  double stick_percent = kUnknown;           // of the CO range
  double stem_lag_s = kUnknown;              // s, time constant of the stem after CO
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

// Returns the five indices, 0 to 100 or NaN.
ConditionIndices condition_indices(const ConditionInputs& in) noexcept;

}  // namespace loopwarden::analysis
