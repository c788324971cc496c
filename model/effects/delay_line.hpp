// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace loopwarden::effects {

// A ring buffer of the last samples of a signal. Only the constructor allocates.
class DelayLine {
 public:
  // Keeps at least `samples` + 1 values.
  explicit DelayLine(std::size_t samples);

  void fill(double value) noexcept {
    for (double& v : values_) v = value;
  }
  void push(double value) noexcept { values_[++newest_ & mask_] = value; }
  // Returns the value `age` samples before the newest one. 0 <= age <= `samples` of the
  // constructor.
  double at(std::size_t age) const noexcept { return values_[(newest_ - age) & mask_]; }

 private:
  std::vector<double> values_;
  std::size_t mask_;
  std::size_t newest_ = 0;
};

}  // namespace loopwarden::effects
