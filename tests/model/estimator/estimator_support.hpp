// SPDX-License-Identifier: Apache-2.0
// A loop and records of it for the tests of the estimator.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/estimator/estimate.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::estimator_test {

inline plant::LoopModel believed_model() {
  plant::LoopModel model;
  model.sample_time_s = 0.1;
  model.controller.pid.output_low = 0.0;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 1.1, .time_constant_s = 2.0, .dead_time_s = 0.8};
  model.process.level = 0.0;
  model.transmitter = {.low = 0.0, .high = 12.0, .resolution = 0.0, .noise = 0.02};
  return model;
}

// A CO that steps and ramps, 2 to 7.
inline std::vector<double> moving_output(std::size_t samples, std::uint64_t seed = 3) {
  numeric::Random random(seed);
  std::vector<double> co;
  double at = 4.0;
  while (co.size() < samples) {
    const double target = random.uniform(2.0, 7.0);
    const bool ramp = random.uniform() < 0.5;
    for (int k = 0; k < 60; ++k) {
      at = ramp ? at + 0.03 * (target - at) : target;
      co.push_back(at);
    }
  }
  co.resize(samples);
  return co;
}

// PV of `truth` under `co`, every sample used.
inline estimator::Observed record_of(const plant::LoopModel& truth, std::vector<double> co,
                                     std::uint64_t seed = 7) {
  plant::Plant plant(truth, seed);
  plant.reset(co.front());
  estimator::Observed out{truth.sample_time_s, std::move(co), {}, {}};
  out.pv.push_back(plant.process_variable());
  for (std::size_t k = 1; k < out.co.size(); ++k) out.pv.push_back(plant.step(out.co[k - 1]));
  out.used.assign(out.pv.size(), true);
  return out;
}

inline void in_order(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}
inline void in_reverse(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = count; i > 0; --i) body(i - 1);
}

inline std::string names_of(const estimator::Estimate& e) {
  std::string text;
  for (const estimator::Found& f : e.effects) text += (text.empty() ? "" : "+") + f.spec.name;
  return text;
}

}  // namespace loopwarden::estimator_test
