// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/rt/order.hpp"

namespace loopwarden::daemon::orders {

// Why an order is refused, with what was asked for and what would be allowed.
std::string why_refused(rt::Refusal refusal, const rt::Order& order,
                        const rt::LoopSettings& settings);

// The same of an order that the loop's cycle has answered: with what was in force by then.
std::string why_refused(const rt::OrderAnswer& answer, const rt::Order& order,
                        const rt::LoopSettings& settings);

}  // namespace loopwarden::daemon::orders
