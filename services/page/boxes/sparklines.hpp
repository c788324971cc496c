// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace loopwarden::page {

// The last ten minutes of every PV: its first, least, greatest and last value in each of 60 steps. First and last say which way it went
// between the extremes.
class Sparklines {
 public:
  static constexpr std::size_t kSteps = 60;
  static constexpr std::int64_t kStep_ms = 10'000;

  // Values in the order of the loops; NaN where there is none. `plant_ms` is the plant's time, which an accelerated
  // simulation runs through faster. Where it goes back, or the number of loops is another, all begins anew.
  void add(std::int64_t plant_ms, const std::vector<double>& pv);

  // {"step_s", "until_ms", "pv": [[first, min, max, last, first, ...] a loop]}; the last step is the one that is still
  // being filled. `until_ms`: UTC of the newest value.
  std::string json(std::int64_t until_ms) const;

 private:
  struct Step {
    float first, low, high, last;  // NaN: none
  };
  void advance(std::int64_t step);

  std::size_t loops_ = 0;
  std::int64_t step_ = -1;    // newest; -1: none yet
  std::vector<Step> values_;  // a ring of kSteps for each loop
};

}  // namespace loopwarden::page
