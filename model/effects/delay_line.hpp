// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace loopwarden::effects {

// The last samples of a signal. All memory is taken when it is made; after that only `push` and `at`.
class DelayLine {
 public:
  // Remembers at least `samples` + 1 values.
  explicit DelayLine(std::size_t samples);

  void fill(double value) noexcept {
    for (double& v : values_) v = value;
  }
  void push(double value) noexcept { values_[++newest_ & mask_] = value; }
  // The value `age` samples before the newest; 0 is the newest. `age` within what was asked for.
  double at(std::size_t age) const noexcept { return values_[(newest_ - age) & mask_]; }

 private:
  std::vector<double> values_;
  std::size_t mask_;
  std::size_t newest_ = 0;
};

}  // namespace loopwarden::effects
