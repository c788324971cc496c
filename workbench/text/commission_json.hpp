// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/commission/commission.hpp"
#include "model/commission/sight.hpp"
#include "model/commission/twin_sight.hpp"

namespace loopwarden::workbench {

// The detectable effects, if the loop was commissioned.
struct CommissionSight {
  std::optional<commission::Sight> specialists{};
  std::vector<commission::TwinSeen> twin{};
};

// Returns commission.json.
nlohmann::json commission_json(const commission::Commissioning& made, const CommissionSight& sight);

// Returns "from 1.5 % of span on, alarm after 12 min".
std::string seen_text(const commission::Seen& seen);
// Returns "from 1.2 s on, alarm after 4 min".
std::string seen_text(const commission::TwinSeen& seen);

}  // namespace loopwarden::workbench
