// SPDX-License-Identifier: Apache-2.0
// The texts that an operator sees with an alarm. ISA-18.2's rationalisation requires them: an event
// without an action is no alarm.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682), rationalisation: cause, consequence of inaction,
// corrective action, time to respond.
#pragma once

#include "model/alarm/alarm_kind.hpp"

namespace loopwarden::alarm {

struct AlarmGuide {
  const char* cause;
  const char* consequence;  // of not acting
  const char* action;
  const char* time_to_act;
};

// Returns the texts of `kind`. A loop's file may replace them. `watched`: another controller runs
// the loop.
AlarmGuide guide_of(AlarmKind kind, bool watched = false) noexcept;

}  // namespace loopwarden::alarm
