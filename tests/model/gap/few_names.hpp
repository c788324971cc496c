// SPDX-License-Identifier: Apache-2.0
// Runs the whole workflow with a few names, one at a time: fast enough for many tests.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::test {

inline gap::Result find_among(const std::vector<std::string>& names,
                              const numeric::LoopRecord& record, const plant::LoopModel& model) {
  gap::Options options{.search = {.several = false, .without = {}}};
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    if (std::find(names.begin(), names.end(), info.name) == names.end()) {
      options.search.without.emplace_back(info.name);
    }
  }
  return gap::find_gap(record, model, options, serial, [](double) {});
}

}  // namespace loopwarden::test
