// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "model/twin/commission.hpp"
#include "workbench/text/commission_json.hpp"

namespace loopwarden::workbench {

// Returns a self-contained page: the measured PV against the model after each step, and the effects
// that the loop can detect.
std::string commission_page(const twin::Commissioning& made,
                            const CommissionDetectability& detectability,
                            const numeric::LoopRecord& record, double seconds);

}  // namespace loopwarden::workbench
