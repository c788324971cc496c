// SPDX-License-Identifier: Apache-2.0
// Runs the whole workflow with a few names: fast enough for many tests.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::test {

// Effects of each block, and those that are nearly the same as a sticking valve or another gain.
inline const std::vector<std::string> kLikely{
    "stiction",           "backlash",         "hysteresis",          "creep",
    "gain_change",        "extra_lag",        "extra_dead_time",     "valve_characteristic",
    "output_bias",        "step_disturbance", "controller_mismatch", "held_measurement",
    "clipped_measurement"};

// One effect of these names, or several.
inline gap::Options options_among(const std::vector<std::string>& names, bool several = false) {
  gap::Options options{.search = {.several = several, .without = {}}};
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    if (std::find(names.begin(), names.end(), info.name) == names.end()) {
      options.search.without.emplace_back(info.name);
    }
  }
  return options;
}

inline gap::Result find_among(const std::vector<std::string>& names,
                              const numeric::LoopRecord& record, const plant::LoopModel& model,
                              const gap::ParallelFor& parallel = serial) {
  return gap::find_gap(record, model, options_among(names), parallel, [](double) {});
}

}  // namespace loopwarden::test
