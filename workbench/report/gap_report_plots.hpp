// SPDX-License-Identifier: Apache-2.0
// The time and phase plots of the gap report.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// Empty where the result holds no series to draw.
std::string gap_time_plots_html(const gap::Result& result);
std::string gap_phase_plots_html(const gap::Result& result);

// Whether the disagreement lies in the controller as well, or the record does not tell.
bool has_controller_gap(const gap::Result& result);

}  // namespace loopwarden::workbench
