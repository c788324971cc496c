// SPDX-License-Identifier: Apache-2.0
// A stretch of one loop's routine operation: the unit that a monitor judges.
#pragma once

#include <cstddef>
#include <cstdint>

#include "model/numeric/loop_record.hpp"
#include "model/specialist/fit/loop_window.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

using specialist::kWindowSamples;

// The values are finite. Without a read-back, all of `stem` is NaN.
struct Window : numeric::LoopView {
  std::size_t bridged_cycles = 0;  // missing cycles of the window, with interpolated values
};

// The reason why there is no window to judge. The register map uses these numbers.
enum class WindowState : std::uint8_t {
  valid = 0,
  filling = 1,              // in progress, since the start or an interruption
  not_automatic = 2,        // manual or fallback
  bad_pv = 3,               // PV bad or uncertain
  gap = 4,                  // cycles are missing
  saturated = 5,            // CO at a limit for more than a tenth of the window
  not_enough_movement = 6,  // too little movement to judge
  no_judge = 7,             // no specialists for this loop
  no_set_point = 8          // SP is not available from the source
};

constexpr const char* to_text(WindowState state) noexcept {
  return numeric::enum_name<WindowState::no_set_point>(
      state, {"valid", "filling", "not automatic", "bad PV", "gap", "saturated",
              "not enough movement", "no specialists", "no set point"});
}

}  // namespace loopwarden::alarm
