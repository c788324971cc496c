// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/twin/commission.hpp"
#include "model/twin/detectability.hpp"
#include "model/twin/twin_detectability.hpp"

namespace loopwarden::workbench {

// The detectable effects, if the loop was commissioned.
struct CommissionDetectability {
  std::optional<twin::Detectability> specialists{};
  std::vector<twin::TwinSeen> twin{};
};

// Returns commission.json.
nlohmann::json commission_json(const twin::Commissioning& made,
                               const CommissionDetectability& detectability);

// Returns "from 1.5 % of span on, alarm after 12 min".
std::string seen_text(const twin::Seen& seen);
// Returns "from 1.2 s on, alarm after 4 min".
std::string seen_text(const twin::TwinSeen& seen);

}  // namespace loopwarden::workbench
