// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/loops/loop_runtime.hpp"
#include "daemon/rt/event.hpp"

namespace loopwarden::daemon {

enum class Severity : unsigned char { info, warning, error };

struct EventText {
  Severity severity = Severity::info;
  std::string text;
};

// Returns the text of an event of the real-time thread, with the loop's units.
EventText describe(const rt::Event& event, const config::LoopConfig& loop);

}  // namespace loopwarden::daemon
