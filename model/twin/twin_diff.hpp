// SPDX-License-Identifier: Apache-2.0
// What has changed between two twins of one loop, number by number: what a second commissioning
// tells.
//
//   friction        the largest of the valve's own, % of the CO span (size_percent of its effects)
//   characteristic  largest difference of flow at the same travel, each times its process gain, over the PV that the newer
//                   record showed, % of the PV span; the gain itself is then no number of its own
//
// Errors: none. What it can't do: say why; that is `gap` with the older twin.
#pragma once

#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::twin {

struct Change {
  std::string what;  // with its unit
  double before = 0.0;
  double now = 0.0;
};

std::vector<Change> changes(const plant::LoopModel& before, const plant::LoopModel& now);

}  // namespace loopwarden::twin
