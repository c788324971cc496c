// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "model/commission/commission.hpp"
#include "model/commission/sight.hpp"

namespace loopwarden::workbench {

// commission.json. `sight` is null where nothing was commissioned.
nlohmann::json commission_json(const commission::Commissioning& made,
                               const commission::Sight* sight);

// "from 1.5 % of span on, alarm after 12 min".
std::string seen_text(const commission::Seen& seen);

}  // namespace loopwarden::workbench
