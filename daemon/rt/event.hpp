// SPDX-License-Identifier: Apache-2.0
// Events of the real-time thread as numbers; daemon/loops/event_text.hpp has their texts.
#pragma once

#include <cstdint>

namespace loopwarden::daemon::rt {

enum class EventCode : std::uint8_t {
  fault_changed,  // a: control::Fault now, b: hal::Reason of PV
  mode_changed,   // a: control::Mode now
  settings_applied,
  settings_wait,       // until the output, `value`, is inside their limits
  command_refused,     // a: Refusal; the loop had changed since the command was accepted
  result_not_finite,   // the result of the controller was not finite or out of range
  jacket_stands_back,  // mean error above its limit
  jacket_resumes,
  cycle_missed,     // a: periods missed, at most 255
  moves_disengaged  // a: control::DisengageReason
};

struct Event {
  std::int64_t time_ns = 0;  // CLOCK_MONOTONIC
  std::uint32_t loop = 0;    // index of the loop
  EventCode code = EventCode::fault_changed;
  std::uint8_t a = 0;
  std::uint8_t b = 0;
  double value = 0.0;  // PV, CO or mean error
};

}  // namespace loopwarden::daemon::rt
