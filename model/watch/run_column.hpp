// SPDX-License-Identifier: Apache-2.0
// The newest samples of a signal that seldom changes, such as a set point. A run of equal samples
// takes 8 bytes, however long it is.
//
// Errors: std::bad_alloc.
// Limits: a signal that changes with every sample takes 8 bytes per sample.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace loopwarden::watch {

class RunColumn {
 public:
  void push(float value) {
    // By their bits, so that NaN equals NaN and 0 differs from -0.
    if (runs_.empty() ||
        std::bit_cast<std::uint32_t>(runs_.back().value) != std::bit_cast<std::uint32_t>(value)) {
      runs_.push_back({value, 0});
    }
    ++runs_.back().samples;
  }

  void clear() noexcept { runs_.clear(); }

  // Removes all samples except the newest `count`.
  void keep_newest(std::size_t count) {
    auto run = runs_.end();
    while (run != runs_.begin() && count > 0) {
      --run;
      run->samples = static_cast<std::uint32_t>(std::min<std::size_t>(run->samples, count));
      count -= run->samples;
    }
    runs_.erase(runs_.begin(), run);
  }

  // Returns the newest `count` samples, or all if there are fewer.
  std::vector<float> newest(std::size_t count) const {
    std::vector<float> samples;
    samples.reserve(count);
    for (auto run = runs_.rbegin(); run != runs_.rend() && samples.size() < count; ++run) {
      const std::size_t some = std::min<std::size_t>(run->samples, count - samples.size());
      samples.insert(samples.end(), some, run->value);
    }
    std::reverse(samples.begin(), samples.end());
    return samples;
  }

 private:
  struct Run {
    float value;
    std::uint32_t samples;
  };
  std::vector<Run> runs_;  // oldest first
};

}  // namespace loopwarden::watch
