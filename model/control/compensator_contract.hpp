// SPDX-License-Identifier: Apache-2.0
// Settings, inputs and result of the valve compensators that add to CO.
//
// A compensator is a class with
//   X(const CompensatorSettings&, double period_s)
//   void reset(double output) noexcept                   starts at this CO with a correction of 0
//   Correction step(const CompensatorInputs&) noexcept   steps one period
// None of them reads a clock, allocates or throws; compensator.hpp holds one of them.
#pragma once

#include <cstdint>
#include <limits>

#include "model/control/output_limiter.hpp"
#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

enum class CompensatorKind : std::uint8_t {
  none,
  knocker,
  two_move,
  reinforcement,
  backlash,
  hysteresis,
  planned_moves
};

// Returns whether `kind` acts in `simulate` and `compare` only. A running loop has it in shadow.
constexpr bool acts_in_simulation_only(CompensatorKind kind) noexcept {
  return kind == CompensatorKind::knocker || kind == CompensatorKind::two_move ||
         kind == CompensatorKind::reinforcement;
}

struct CompensatorSettings {
  CompensatorKind kind = CompensatorKind::none;
  bool shadow = false;                                     // computed and recorded, but not acting
  double limit = std::numeric_limits<double>::infinity();  // CO units, most it may add

  double amplitude = 0.0;       // CO units: knocker, reinforcement
  double pulse_period_s = 2.0;  // s: knocker
  double pulse_width_s = 0.4;   // s: knocker
  double stick_band = 0.0;      // CO units: two_move
  double factor = 1.5;          // of the stick band: two_move
  double move_time_s = 5.0;     // s: two_move
  double max_mean_error = std::numeric_limits<double>::infinity();  // PV units: two_move
  double mean_error_time_s = 60.0;                                  // s: two_move
  double gap = 0.0;                                                 // CO units: backlash
  double width = 0.0;                                               // CO units: hysteresis
  double knee = 0.0;                                                // hysteresis
  double offset = 0.0;                                              // CO units: hysteresis
  double noise_band =
      0.0;  // CO units, smaller reversals do not count: reinforcement, backlash, hysteresis
  PlannedMovesSettings planned{};

  friend bool operator==(const CompensatorSettings&, const CompensatorSettings&) = default;
};

struct CompensatorInputs {
  double set_point = 0.0;  // PV units
  double error = 0.0;      // PV units
  double output = 0.0;     // CO units, the control law's result without correction
  // For planned_moves.
  double process_variable = 0.0;  // PV units
  double applied = 0.0;           // CO units, output written one period ago
  double commanded = 0.0;         // CO units, the same before the device's rounding
  double valve_position = 0.0;    // CO units, read back
  bool valve_position_valid = false;
  OutputLimits limits{};  // of the output
};

// Returns whether `output`, CO units, is as near to `wanted` as the limits allow: no ramp is under
// way.
inline bool has_arrived(const OutputLimits& limits, double wanted, double output,
                        double period_s) noexcept {
  return !limit_output(limits, wanted, output, period_s).rate_limited;
}

struct Correction {
  double added = 0.0;          // CO units, to the control law's result
  bool hold_integral = false;  // the controller does not integrate
  bool release = false;        // the integral takes over `added` and what was added before
};

}  // namespace loopwarden::control
