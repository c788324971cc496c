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
};

// A wish of the operator, applied at the start of the next cycle.
struct OperatorCommand {
  enum class Kind : std::uint8_t {
    set_point,
    manual,
    automatic,
    output,
    jacket_off,
    jacket_shadow,
    jacket_on,
    kp,
    ki,
    kd
  };
  Kind kind = Kind::set_point;
  // set_point: PV units; output: CO units; kp, ki, kd: of the parallel form, until the next reload
  double value = 0.0;
};

}  // namespace loopwarden::daemon::rt
