// SPDX-License-Identifier: Apache-2.0
// Finds out whether a controller moved CO, and which moves of CO had an external cause. Equations
// and sources: docs/math/sticking-cycle.md.
//
// Rows are the samples in which the controller acts: every n-th sample of a faster record
// (identification.cpp). Errors: no exceptions.
// Limits: no other controllers that are far from linear; no operator who slowly moves a manual
// valve after PV. A switching controller with an exactly repeating record counts as a clock,
// because it has no external moves.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/numeric/loop_record.hpp"
#include "model/plant/process.hpp"

namespace loopwarden::analysis {

// The law of the controller.
struct Feedback {
  bool closed = false;
  bool by_mode = false;    // `closed` follows from the mode of the record
  double explained = 0.0;  // by PV: share of the variance that the past of CO and SP leave
  bool set_point_moves = false;
  std::array<double, 3> own{};    // a
  std::array<double, 3> of_pv{};  // b
  std::array<double, 3> of_sp{};  // c
  std::vector<double> jumps;      // the jumps of n, otherwise 0, CO units; empty if SP is known
};

// Returns the fitted law of the controller and whether the loop is closed.
Feedback find_feedback(const numeric::LoopView& columns);

enum class SwitchingLaw : std::uint8_t { none, two_levels, pulses, gap_action };
const char* to_text(SwitchingLaw law) noexcept;
// Returns the law of a switching controller, or `none`.
SwitchingLaw switching_law(const numeric::LoopView& columns);

// Returns the CO that only the external moves would cause, as a deviation from 0, CO units. It is
// empty if that loop is unstable, because such a law can't have controlled this process.
std::vector<double> outside_output(const numeric::LoopView& columns, const Feedback& feedback,
                                   const plant::ProcessParameters& process, double period_s);

// Gains of u = kp e + ki integral(e), e = SP - PV, by least squares on the differences of CO. Their
// sign is that of the controller's action. Without SP a constant set point is estimated, too.
struct PiGains {
  double kp = 0.0;         // CO units/PV unit
  double ki = 0.0;         // CO units/(PV unit s)
  double explained = 0.0;  // explained share of the moves of CO, 0 to 1
  double set_point = 0.0;  // PV units, the estimate if SP is not given
};
PiGains find_pi_gains(const numeric::LoopView& columns);

}  // namespace loopwarden::analysis
