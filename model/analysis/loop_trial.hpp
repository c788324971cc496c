// SPDX-License-Identifier: Apache-2.0
// Closed-loop runs of a loop model for comparisons: columns, and the responses to steps.
#pragma once

#include <cstddef>
#include <vector>

#include "model/analysis/step_metrics.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::analysis {

struct SimulatedRecord : numeric::LoopRecord {
  std::vector<double> true_pv;  // before noise and resolution of the transmitter
};

// Runs the model in closed loop for `duration_s`, s, and returns its columns.
SimulatedRecord run_model(const plant::LoopModel& model, double duration_s);

// The response of the loop to two steps at mid range: a set-point step of 10 % of the transmitter's
// range, then a disturbance step of -10 % of it.
struct PredictedResponse {
  SimulatedRecord record;            // starts at the set-point step
  StepMetrics step;                  // of the set-point step
  double load_absolute_error = 0.0;  // integral of |SP - PV| after the disturbance step, PV units s
  std::size_t load_from = 0;         // sample of the disturbance step
  bool settles = false;              // within 5 % before the disturbance step
};
// Runs the model with these gains, without valve effects, faults and noise. The disturbance step is
// at `half_duration_s`, s.
PredictedResponse predict_response(plant::LoopModel model, const control::PidGains& gains,
                                   double half_duration_s);

}  // namespace loopwarden::analysis
