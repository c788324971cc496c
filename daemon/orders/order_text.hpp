// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/rt/order.hpp"

namespace loopwarden::daemon::orders {

// Returns "kp 0.61 ki 0.07 kd 0", with all digits.
std::string gains_text(const control::PidGains& gains);

// Returns why an order is refused, with the requested and the allowed values.
std::string why_refused(rt::Refusal refusal, const rt::Order& order,
                        const rt::LoopSettings& settings);

// Does the same for an order that the loop's cycle has answered, with the values in force at that
// time.
std::string why_refused(const rt::OrderAnswer& answer, const rt::Order& order,
                        const rt::LoopSettings& settings);

}  // namespace loopwarden::daemon::orders
