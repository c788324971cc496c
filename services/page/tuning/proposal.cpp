// SPDX-License-Identifier: Apache-2.0
#include "services/page/tuning/proposal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace loopwarden::page::tuning {
namespace {

constexpr double kMostSteps = 20'000.0;  // of each half of a simulation

std::array<double, 2> interval(const analysis::Estimate& estimate) {
  return {estimate.low, estimate.high};
}

double middle(const std::array<double, 2>& range) { return 0.5 * (range[0] + range[1]); }

}  // namespace

plant::LoopModel model_of(plant::LoopModel twin, const LoopFacts& loop) {
  plant::LoopModel model = std::move(twin);
  model.sample_time_s =
      std::max(loop.sample_time_s, analysis::watched_s(model.process) / kMostSteps);
  control::ControllerSettings& controller = model.controller;
  controller = {};
  controller.pid.gains = loop.gains;
  controller.set_point.low = loop.pv_range[0];
  controller.set_point.high = loop.pv_range[1];
  model.transmitter.low = loop.pv_range[0];
  model.transmitter.high = loop.pv_range[1];
  std::erase_if(model.transmitter_effects,
                [](const effects::EffectSpec& effect) { return effect.name == "output_bias"; });
  model.process.level.reset();
  return model;
}

Identified identified(const StepRecord& record, const LoopFacts& loop) {
  Identified out;
  analysis::Identification found;
  try {
    found = analysis::identify(record.view());
  } catch (const analysis::IdentificationError& e) {
    out.why_not = e.what();
    return out;
  }
  out.notes = found.notes;
  if (!found.can_tell()) {
    out.why_not = found.reason;
    out.settle = found.settle;
    return out;
  }
  const analysis::ProcessFit& best = found.best();
  out.fit_percent = best.fit_percent;
  out.gain = interval(best.gain);
  out.time_constant_s = interval(best.time_constant_s);
  out.dead_time_s = interval(best.dead_time_s);
  plant::LoopModel model;
  model.process = best.process();
  out.model = model_of(std::move(model), loop);
  return out;
}

Proposal propose(const plant::LoopModel& model, const LoopFacts& loop,
                 analysis::ControllerForm form) {
  const auto rounded = [](double value) { return std::stod(fmt::format("{:.4g}", value)); };
  // For a process that falls as CO rises, the mirror image is simulated. The model's PV is its gain
  // times CO. The range of CO is therefore moved until its middle gives mid-range PV, and CO is
  // moved back afterwards.
  plant::LoopModel simulated = model;
  simulated.process.gain = std::abs(model.process.gain);
  const double at_middle = model.process.integrating()
                               ? middle(loop.output_limits)
                               : middle(loop.pv_range) / analysis::linear_loop(simulated).gain;
  const double half = 0.5 * (loop.output_limits[1] - loop.output_limits[0]);
  control::ControllerSettings& controller = simulated.controller;
  controller.pid.output_low = controller.output.low = at_middle - half;
  controller.pid.output_high = controller.output.high = at_middle + half;
  const double sign = model.process.gain < 0.0 ? -1.0 : 1.0;
  Proposal out;
  out.trials = analysis::try_rules(simulated, {.form = form}, loop.gains.derivative_filter_s);
  for (analysis::RuleTrial& trial : out.trials) {
    for (double& co : trial.response.record.co) {
      co = middle(loop.output_limits) + sign * (co - at_middle);
    }
    if (!trial.rule) continue;
    trial.gains.kp = rounded(trial.gains.kp);
    trial.gains.ki = rounded(trial.gains.ki);
    trial.gains.kd = rounded(trial.gains.kd);
  }
  if (const analysis::RuleTrial* best = analysis::recommended(out.trials)) {
    out.recommended = static_cast<std::size_t>(best - out.trials.data());
  }
  return out;
}

}  // namespace loopwarden::page::tuning
