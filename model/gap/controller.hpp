// SPDX-License-Identifier: Apache-2.0
// The controller alone: from the measured SP and PV to CO, against the measured CO.
//
// The model's own PI law (model/control/pid.hpp) is replayed, its integral started so that the
// first output is the measured one. Where the outputs part, Kp and Ki are found from
//   u(k) - u(k-1) = Kp (e(k) - e(k-1)) + Ki h e(k)
// by least squares over the samples away from the limits, then refined on the replayed output
// itself.
//
// Where other gains leave much of the difference, a filter on PV and a dead band of the error are
// tried beside them:
//   T y' = PV - y in the place of PV     e - clamp(e, -D, D) in the place of e
// and one of the two is found if it leaves next to nothing.
//
// Other settings are found only if the given ones miss CO by more than its rounding from any state
// of the integral at the start, and if the found ones leave little in the last third, too.
//
// A difference that another anti-windup explains is reported as such and never as other settings.
// What it can't do: filter and dead band together, set-point weighting, manual periods. The
// controller of a loop model has neither filter nor dead band: a corrected model takes the gains
// over, not these.
#pragma once

#include <string>
#include <vector>

#include "model/gap/record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

struct ControllerFinding {
  bool compared = false;                    // SP, PV and CO are there
  bool mismatch = false;                    // other Kp, Ki explain the measured CO
  bool unexplained = false;                 // CO differs, and nothing known explains it
  bool exact = false;                       // over the whole record they leave nothing worth a word
  std::string anti_windup;                  // explained by this instead of the model's; empty: no
  double kp = 0.0, ki = 0.0;                // as found, CO units / PV unit, CO units / PV unit s
  double filter_s = 0.0;                    // T, s; 0: none
  double dead_band = 0.0;                   // D, PV units; 0: none
  double kp_spread = 0.0, ki_spread = 0.0;  // standard deviations
  double before_rmse = 0.0, after_rmse = 0.0;  // CO units, whole record
  double training_rmse_before = 0.0;           // CO units
  std::vector<double> before, after;           // CO units, replayed
};

// Fits on the first two thirds.
ControllerFinding compare_controller(const LoopRecord& record, const plant::LoopModel& model);

// CO as the model's controller gives it from SP and PV, from `first_output`.
std::vector<double> replay_controller(const control::PidSettings& settings, double period_s,
                                      const std::vector<double>& sp, const std::vector<double>& pv,
                                      double first_output);

}  // namespace loopwarden::gap
