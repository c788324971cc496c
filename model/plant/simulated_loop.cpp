// SPDX-License-Identifier: Apache-2.0
#include "model/plant/simulated_loop.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::plant {
namespace {

// Returns the settings with a tolerance that keeps the rounding by the converter from counting as
// windup.
control::ControllerSettings with_resolution(control::ControllerSettings settings,
                                            double output_resolution) {
  settings.pid.tolerance = std::max(settings.pid.tolerance, output_resolution);
  return settings;
}

}  // namespace

SimulatedLoop::SimulatedLoop(const LoopModel& model, double output_resolution)
    : set_point_(model.scenario.set_point),
      output_low_(model.controller.pid.output_low),
      output_resolution_(output_resolution),
      plant_(model, model.scenario.seed),
      controller_(with_resolution(model.controller, output_resolution), model.sample_time_s,
                  set_point_.empty() ? plant_.process_variable() : set_point_.front().second,
                  output_low_) {
  if (!set_point_.empty()) {
    const double start = plant_.output_for(set_point_.front().second);
    plant_.reset(start);
    controller_.assume_output(start);
  }
  controller_.request_mode(control::Mode::automatic);
}

LoopSample SimulatedLoop::step() noexcept {
  LoopSample sample;
  sample.time_s = plant_.time_s();
  while (next_set_point_ < set_point_.size() &&
         set_point_[next_set_point_].first <= sample.time_s) {
    controller_.request_set_point(set_point_[next_set_point_++].second);
  }
  sample.pv = plant_.process_variable();
  sample.true_pv = plant_.true_process_variable();
  sample.stem = plant_.stem();
  const control::ControllerOutput out = controller_.step({.process_variable = sample.pv,
                                                          .valve_position = plant_.stem(),
                                                          .valve_position_valid = true,
                                                          .read_back = plant_.stem(),
                                                          .read_back_valid = true});
  sample.sp = out.set_point;
  sample.co = out.output;
  if (output_resolution_ > 0.0) {
    sample.co = output_low_ + output_resolution_ *
                                  std::nearbyint((out.output - output_low_) / output_resolution_);
    controller_.applied(sample.co);
  }
  sample.jacket_rate = out.jacket_rate;
  sample.jacket_shadow_rate = out.jacket_shadow_rate;
  sample.correction = out.correction;
  sample.severity = plant_.fault_severity();
  plant_.step(sample.co);
  return sample;
}

}  // namespace loopwarden::plant
