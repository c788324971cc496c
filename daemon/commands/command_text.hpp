// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/rt/command.hpp"

namespace loopwarden::daemon::commands {

// "kp 0.61 ki 0.07 kd 0": all digits.
std::string gains_text(const control::PidGains& gains);

// Why an order is refused, with what was asked for and what would be allowed.
std::string why_refused(rt::Refusal refusal, const rt::Command& command,
                        const rt::LoopSettings& settings);

// The same of an order that the loop's cycle has answered: with what was in force by then.
std::string why_refused(const rt::CommandAnswer& answer, const rt::Command& command,
                        const rt::LoopSettings& settings);

}  // namespace loopwarden::daemon::commands
