// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// Returns gap.json. Values that are not finite become null, because JSON has no NaN.
nlohmann::json gap_json(const gap::Result& result);

}  // namespace loopwarden::workbench
