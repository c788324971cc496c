// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/silence.hpp"

#include <fmt/format.h>

#include <cmath>

namespace loopwarden::workbench::setup {

void Silence::see(double time_s, double value) noexcept {
  seen_s_ = time_s;
  told_ = std::isfinite(value);
  const bool away = told_ && std::abs(value - settings_.before) > settings_.least;
  if (!away) {
    away_since_s_.reset();
  } else if (!away_since_s_) {
    away_since_s_ = time_s;
  }
}

std::string Silence::why_not() const {
  // A deviation only at the very end may be noise.
  constexpr double kStays_s = 1.0;
  if (!told_) return "the valve's position was not known at the end";
  if (!away_since_s_ || seen_s_ - *away_since_s_ < kStays_s) {
    return fmt::format("the valve did not move in {:.0f} s, or did not keep its new position",
                       seen_s_);
  }
  // Some devices have coarse clocks. A move before half of the time is not caused by a watchdog.
  const double silent_s = *away_since_s_ - settings_.written_s;
  if (silent_s < 0.5 * settings_.timeout_s) {
    return fmt::format(
        "the valve, or its measured position, moved {:.1f} s after the last order, too soon for a "
        "watchdog of {:g} s: "
        "something else moved it",
        *away_since_s_, settings_.timeout_s);
  }
  return {};
}

}  // namespace loopwarden::workbench::setup
