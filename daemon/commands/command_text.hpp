// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/rt/command.hpp"

namespace loopwarden::daemon::commands {

// Returns "kp 0.61 ki 0.07 kd 0", with all digits.
std::string gains_text(const control::PidGains& gains);

// Returns why a command is refused, with the requested and the allowed values.
std::string why_refused(rt::Refusal refusal, const rt::Command& command,
                        const rt::LoopSettings& settings);

// Does the same for a command that the loop's cycle has answered, with the values in force at that
// time.
std::string why_refused(const rt::CommandAnswer& answer, const rt::Command& command,
                        const rt::LoopSettings& settings);

}  // namespace loopwarden::daemon::commands
