// SPDX-License-Identifier: Apache-2.0
// Closed-loop runs of a loop model for comparisons: columns, and the answer to a set-point step.
#pragma once

#include <cstddef>
#include <vector>

#include "model/analysis/step_metrics.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::analysis {

struct LoopRecord {
  std::vector<double> sp, pv, co, stem;
  std::vector<double> true_pv;  // before noise and resolution of the transmitter
  double sample_time_s = 0.1;   // s
};

LoopRecord run_model(const plant::LoopModel& model, double duration_s);

// The model's loop with these gains, without valve effects, faults and noise, on a set-point step of
// 10 % of the transmitter's range at mid range, and on a load step of -10 % of it later.
struct PredictedResponse {
  LoopRecord record;                 // from the set-point step on
  StepMetrics step;                  // of the set-point step
  double load_absolute_error = 0.0;  // integral of |SP - PV| after the load step, PV units s
  std::size_t load_from = 0;         // sample of the load step
  bool settles = false;              // within 5 % before the load step
};
PredictedResponse predict_response(plant::LoopModel model, const control::PidGains& gains,
                                   double half_duration_s);

}  // namespace loopwarden::analysis
