// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/loop_trial.hpp"

#include <cmath>
#include <span>

#include "model/plant/simulated_loop.hpp"

namespace loopwarden::analysis {

SimulatedRecord run_model(const plant::LoopModel& model, double duration_s) {
  plant::SimulatedLoop loop(model);
  SimulatedRecord record;
  record.period_s = model.sample_time_s;
  const auto samples = static_cast<std::size_t>(std::floor(duration_s / model.sample_time_s)) + 1;
  for (std::size_t k = 0; k < samples; ++k) {
    const plant::LoopSample s = loop.step();
    record.sp.push_back(s.sp);
    record.pv.push_back(s.pv);
    record.co.push_back(s.co);
    record.stem.push_back(s.stem);
    record.true_pv.push_back(s.true_pv);
  }
  return record;
}

PredictedResponse predict_response(plant::LoopModel model, const control::PidGains& gains,
                                   double half_duration_s) {
  const double span = model.transmitter.span();
  const double middle = model.transmitter.low + 0.5 * span;
  const double step = 0.1 * span;
  model.controller.pid.gains = gains;
  model.controller.jacket = {};
  model.valve_effects.clear();
  model.scenario.faults.clear();
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  model.scenario.set_point = {{0.0, middle}, {model.sample_time_s, middle + step}};
  model.disturbances = {
      {.name = "step_disturbance", .parameters = {{"size", -step}, {"time", half_duration_s}}}};
  PredictedResponse p;
  p.record = run_model(model, 2.0 * half_duration_s);
  p.load_from = static_cast<std::size_t>(half_duration_s / model.sample_time_s);
  p.step = step_metrics(std::span(p.record.pv).subspan(1, p.load_from - 1), middle, middle + step,
                        model.sample_time_s);
  p.settles = std::isfinite(p.step.settling_5_s);
  for (std::size_t k = p.load_from; k < p.record.pv.size(); ++k) {
    p.load_absolute_error += std::abs(p.record.sp[k] - p.record.pv[k]) * model.sample_time_s;
  }
  return p;
}

}  // namespace loopwarden::analysis
