// SPDX-License-Identifier: Apache-2.0
// What model files and loop files say alike about a controller.
#pragma once

#include <array>
#include <optional>

#include "config/map_reader.hpp"
#include "model/control/loop_controller.hpp"

namespace loopwarden::config {

inline constexpr std::array kActions{Choice<control::Action>{"direct", control::Action::direct},
                                     Choice<control::Action>{"reverse", control::Action::reverse}};

// The gains, in the parallel form (kp, ki, kd) or the ISA standard form (kc or pb, ti or ti_min,
// td). The spans, in PV and CO units, convert the latter; without them the gains stay zero.
control::PidGains read_gains(MapReader& in, std::optional<double> pv_span,
                             std::optional<double> co_span);

// anti_windup and tracking_time.
void read_anti_windup(MapReader& in, control::AntiWindup fallback, control::PidSettings& pid);

// The keys within jacket.
control::JacketSettings read_jacket(MapReader& in);

// The keys within compensator: those of its kind only.
control::CompensatorSettings read_compensator(MapReader& in);

// Refuses planned moves whose process gain contradicts the controller's action: they would drive
// PV away from the set point.
void check_gain(MapReader& compensator, const control::CompensatorSettings& settings,
                control::Action action);

// sample_time, s.
Value<double> read_sample_time(MapReader& in);

}  // namespace loopwarden::config
