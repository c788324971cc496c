// SPDX-License-Identifier: Apache-2.0
// Draws the plots of the gap report: over time, and one quantity over another.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// Returns each plot as a picture, with its points as JSON for gap_report.js. Empty if the result
// has no series.
std::string gap_plots_html(const gap::Result& result);

// Returns whether the controller deviates from its model as well, or the record cannot show it.
bool has_controller_gap(const gap::Result& result);

}  // namespace loopwarden::workbench
