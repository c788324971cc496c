// SPDX-License-Identifier: Apache-2.0
// The controller keys that model files and loop files share.
#pragma once

#include <array>
#include <optional>

#include "config/map_reader.hpp"
#include "model/control/loop_controller.hpp"

namespace loopwarden::config {

inline constexpr std::array kActions{Choice<control::Action>{"direct", control::Action::direct},
                                     Choice<control::Action>{"reverse", control::Action::reverse}};

// Reads the gains, in the parallel form (kp, ki, kd) or the ISA standard form (kc or pb, ti or
// ti_min, td). The spans, in PV and CO units, are needed to convert the standard form. Without them
// the gains stay zero.
control::PidGains read_gains(MapReader& in, std::optional<double> pv_span,
                             std::optional<double> co_span);

// Reads anti_windup and tracking_time.
void read_anti_windup(MapReader& in, control::AntiWindup fallback, control::PidSettings& pid);

// Reads the keys within jacket.
control::JacketSettings read_jacket(MapReader& in);

// Reads the keys within compensator, only those of its kind.
control::CompensatorSettings read_compensator(MapReader& in);

// Refuses planned moves whose process gain contradicts the controller's action, because they would
// drive PV away from the set point.
void check_gain(MapReader& compensator, const control::CompensatorSettings& settings,
                control::Action action);

// Reads sample_time, s.
Value<double> read_sample_time(MapReader& in);

}  // namespace loopwarden::config
