// SPDX-License-Identifier: Apache-2.0
// A loop and records of it for the tests of the gap workflow.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/effects/catalogue.hpp"
#include "model/effects/effect.hpp"
#include "model/gap/record.hpp"
#include "model/plant/plant.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::test {

inline plant::LoopModel believed_model() {
  plant::LoopModel model;
  model.sample_time_s = 0.1;
  model.controller.pid.gains.kp = 0.4;
  model.controller.pid.gains.ki = 0.15;
  model.controller.pid.output_low = 0.0;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 1.1, .time_constant_s = 2.0, .dead_time_s = 0.8};
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 0.0, .noise = 0.0};
  return model;
}

// A simulated run, measured every sample.
inline numeric::LoopRecord run_of(const plant::LoopModel& truth, double seconds) {
  plant::SimulatedLoop loop(truth, 10.0 / 4096.0);
  numeric::LoopRecord record{.period_s = truth.sample_time_s, .pv = {}, .sp = {}, .co = {}};
  for (double t = 0.0; t < seconds; t += truth.sample_time_s) {
    const plant::LoopSample s = loop.step();
    record.pv.push_back(s.pv);
    record.sp.push_back(s.sp);
    record.co.push_back(s.co);
  }
  return record;
}

// The same with SP steps and noise.
inline numeric::LoopRecord record_of(plant::LoopModel truth, double seconds,
                                     std::uint64_t seed = 7) {
  truth.transmitter.noise = 0.015;
  truth.scenario.seed = seed;
  truth.scenario.set_point = {{0.0, 3.0},  {10.0, 5.0}, {35.0, 6.5},
                              {60.0, 4.0}, {85.0, 5.5}, {110.0, 3.5}};
  return run_of(truth, seconds);
}

// A CO that steps, ramps and reverses, 2 to 7.5.
inline std::vector<double> exciting_output(std::size_t samples, std::uint64_t seed = 11) {
  numeric::Random random(seed);
  std::vector<double> co;
  double u = 4.0;
  while (co.size() < samples) {
    const double target = 2.0 + 5.5 * random.uniform();
    const bool ramp = random.uniform() < 0.5;
    const auto length = static_cast<std::size_t>(15.0 + 50.0 * random.uniform());
    for (std::size_t i = 0; i < length && co.size() < samples; ++i) {
      u = ramp ? u + (target - u) * 0.08 : target;
      co.push_back(u);
    }
  }
  return co;
}

// Returns PV of the plant under a given CO.
inline std::vector<double> driven(const plant::LoopModel& model, const std::vector<double>& co,
                                  std::uint64_t seed = 1) {
  plant::Plant plant(model, seed);
  plant.reset(co.front());
  std::vector<double> pv;
  for (const double u : co) {
    pv.push_back(plant.process_variable());
    plant.step(u);
  }
  return pv;
}

// Returns the candidates that the workflow makes for a model and a CO.
inline std::vector<effects::Candidate> candidates_for(const plant::LoopModel& m,
                                                      const std::vector<double>& co) {
  const auto [low, high] = std::minmax_element(co.begin(), co.end());
  return effects::candidates({.output_low = m.controller.pid.output_low,
                              .output_high = m.controller.pid.output_high,
                              .output_used_low = *low,
                              .output_used_high = *high,
                              .pv_low = m.transmitter.low,
                              .pv_high = m.transmitter.high,
                              .period_s = m.sample_time_s,
                              .duration_s = static_cast<double>(co.size()) * m.sample_time_s,
                              .time_constant_s = m.process.time_constant_s,
                              .dead_time_s = m.process.dead_time_s});
}

inline const effects::Candidate& of_name(const std::vector<effects::Candidate>& all,
                                         const std::string& name) {
  return *std::find_if(all.begin(), all.end(),
                       [&](const effects::Candidate& c) { return c.name == name; });
}

inline void serial(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

}  // namespace loopwarden::test
