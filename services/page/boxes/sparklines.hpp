// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace loopwarden::page {

// The last ten minutes of every PV: its first, least, greatest and last value in each of 60 steps.
// First and last value show the direction between the extremes.
class Sparklines {
 public:
  static constexpr std::size_t kSteps = 60;
  static constexpr std::int64_t kStep_ms = 10'000;

  // Adds values in the order of the loops; NaN for a missing value. `plant_ms` is the plant's time,
  // which runs faster in an accelerated simulation. If it decreases, or the number of loops
  // changes, all steps are cleared.
  void add(std::int64_t plant_ms, const std::vector<double>& pv);

  // Returns {"step_s", "until_ms", "pv": [[first, min, max, last, first, ...] per loop]}. The last
  // step is still being filled. `until_ms`: UTC of the newest value.
  std::string json(std::int64_t until_ms) const;

 private:
  struct Step {
    float first, low, high, last;  // NaN: no value
  };
  void advance(std::int64_t step);

  std::size_t loops_ = 0;
  std::int64_t step_ = -1;    // newest; -1: no step yet
  std::vector<Step> values_;  // a ring of kSteps for each loop
};

}  // namespace loopwarden::page
