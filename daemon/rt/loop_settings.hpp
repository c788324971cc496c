// SPDX-License-Identifier: Apache-2.0
// What may change while a loop runs; handed over whole and applied between two cycles.
#pragma once

#include "hal/contract/pv_check_settings.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::rt {

struct LoopSettings {
  control::ControllerSettings controller;
  control::SafetySettings safety;
  hal::PvCheckSettings pv_check;
  bool jacket_may_act = true;  // false: only its shadow, whatever the operator asks for
};

}  // namespace loopwarden::daemon::rt
