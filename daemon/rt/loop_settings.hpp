// SPDX-License-Identifier: Apache-2.0
// Settings that may change while a loop runs. A reload replaces all of them between two cycles.
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
  bool jacket_may_act = true;  // false: the jacket runs in shadow only
  bool moves_may_act = false;  // planned moves, as corrective action
};

// Settings from a reload to the cycle.
struct SettingsOffer {
  LoopSettings settings;
  std::uint32_t number = 0;  // counts up from 1
  bool withdrawn = false;    // drops an offer that waits; `settings` are ignored
};

// Returns true if the offered limits can replace the limits in force without moving the output, in
// CO units. Tighter limits need an output that is known to be inside them.
inline bool can_take_over(const control::OutputLimits& offered, const control::OutputLimits& now,
                          bool output_known, double output) noexcept {
  const bool no_tighter = offered.low <= now.low && offered.high >= now.high;
  return no_tighter || (output_known && output >= offered.low && output <= offered.high);
}

}  // namespace loopwarden::daemon::rt
