// SPDX-License-Identifier: Apache-2.0
// The plots of the gap report over time, and of one quantity over another.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// Each as a picture, and its points as JSON for gap_report.js. Empty where the result holds no series to draw.
std::string gap_plots_html(const gap::Result& result);

// Whether the disagreement lies in the controller as well, or the record does not tell.
bool has_controller_gap(const gap::Result& result);

}  // namespace loopwarden::workbench
