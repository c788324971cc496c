// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "model/twin/commission.hpp"
#include "workbench/text/commission_json.hpp"

namespace loopwarden::workbench {

// A self-contained page: measured PV against the model after each step, and what can be seen on the loop.
std::string commission_page(const twin::Commissioning& made, const CommissionSight& sight,
                            const gap::Record& record, double seconds);

}  // namespace loopwarden::workbench
