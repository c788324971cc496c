// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "model/alarm/process_watch.hpp"
#include "record/record_row.hpp"

namespace loopwarden::daemon::supervision {

// Returns the reason of a changed process alarm, from the cycle that changed it. `unit`: of PV.
std::string why_changed(const alarm::ProcessChange& change, const record::RecordRow& row,
                        const alarm::ProcessSettings& settings, const std::string& unit);

}  // namespace loopwarden::daemon::supervision
