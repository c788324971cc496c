// SPDX-License-Identifier: Apache-2.0
// Collects the results of a loop's twin over a record, in addition to its alarm, for `replay
// --json`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "model/watch/loop_monitor.hpp"

namespace loopwarden::workbench {

class TwinLog {
 public:
  // Call after each cycle of a loop with a twin.
  void add(const watch::LoopMonitor& loop, double time_s);
  // Returns {"judged_share", "controller_not_watched": null or why,
  // "load_outside": [{from_s, to_s, size}], "untested_s": {change: s}}.
  nlohmann::json json(const watch::LoopMonitor& loop) const;

 private:
  struct Load {
    double from_s, to_s;
    double size;  // PV units, the largest
  };
  std::vector<Load> loads_;
  bool outside_ = false;
  std::size_t cycles_ = 0;
  std::size_t judged_ = 0;
};

}  // namespace loopwarden::workbench
