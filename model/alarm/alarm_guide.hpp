// SPDX-License-Identifier: Apache-2.0
// What an operator is told with an alarm, as ISA-18.2's rationalisation asks: an alarm without an action is none.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682), rationalisation: cause, consequence of inaction, corrective action, time to respond.
#pragma once

#include "model/alarm/alarm_kind.hpp"

namespace loopwarden::alarm {

struct AlarmGuide {
  const char* cause;
  const char* consequence;  // of doing nothing
  const char* action;
  const char* time_to_act;
};

// A loop's file may say other texts.
AlarmGuide guide_of(AlarmKind kind) noexcept;

}  // namespace loopwarden::alarm
