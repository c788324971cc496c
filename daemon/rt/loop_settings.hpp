// SPDX-License-Identifier: Apache-2.0
// What may change while a loop runs; handed over whole and applied between two cycles.
#pragma once

#include <cstdint>

#include "hal/contract/pv_check_settings.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::rt {

struct LoopSettings {
  control::ControllerSettings controller;
  control::SafetySettings safety;
  hal::PvCheckSettings pv_check;
  bool jacket_may_act = true;  // false: only its shadow, whatever the operator asks for
  bool moves_may_act = false;  // planned moves, as corrective action
};

// What a reload hands to the cycle.
struct SettingsOffer {
  LoopSettings settings;
  std::uint32_t number = 0;  // counts up from 1
  bool withdrawn = false;    // what waits is no longer to be taken; `settings` are not looked at
};

// Whether limits may take the place of those in force without moving the output: tighter ones only
// while the output, CO units, is known to be inside.
inline bool can_take_over(const control::OutputLimits& offered, const control::OutputLimits& now,
                          bool output_known, double output) noexcept {
  const bool no_tighter = offered.low <= now.low && offered.high >= now.high;
  return no_tighter || (output_known && output >= offered.low && output <= offered.high);
}

}  // namespace loopwarden::daemon::rt
