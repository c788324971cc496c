// SPDX-License-Identifier: Apache-2.0
// The time that a loop has spent in each mode, and at an end of its output, since the start.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "model/control/loop_controller.hpp"

namespace loopwarden::watch {

class ModeTimes {
 public:
  explicit ModeTimes(double period_s) noexcept : period_s_(period_s) {}

  // Adds one cycle. Missing cycles count for no mode.
  void add(control::Mode mode, bool at_limit) noexcept {
    const auto index = static_cast<std::size_t>(mode);
    if (index < cycles_.size()) ++cycles_[index];
    if (at_limit) ++at_limit_;
  }

  double seconds_in(control::Mode mode) const noexcept {
    return period_s_ * static_cast<double>(cycles_[static_cast<std::size_t>(mode)]);
  }
  double seconds_at_limit() const noexcept { return period_s_ * static_cast<double>(at_limit_); }

 private:
  double period_s_;  // s
  // Whole cycles, so that years add up without rounding.
  std::array<std::uint64_t, 3> cycles_{};
  std::uint64_t at_limit_ = 0;
};

}  // namespace loopwarden::watch
