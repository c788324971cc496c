// SPDX-License-Identifier: Apache-2.0
// Writes the page of `diagnose --report`.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "workbench/text/diagnose_text.hpp"

namespace loopwarden::workbench {

// Returns the times of the samples that the diagnosis used, in s. Samples that gates cut off at the
// front count.
std::vector<double> sample_times(const DiagnosedWindow& window);

// Returns a page with one section per window: the trend with the stuck stretches marked, and PV
// over CO with the fitted band.
std::string diagnosis_page(const DiagnosedLoop& loop);

// The response of a valve with this band to CO, for the pictures. PV follows the valve after the
// process' dead time and lag. So the stuck stretches are marked on CO, and PV is drawn with the
// best-fitting delay.
struct ValveView {
  std::vector<double> standing;  // CO while it moves and the valve is stuck, otherwise NaN
  std::vector<double> followed;  // PV units, NaN before the dead time
  std::size_t dead_time = 0;     // samples
};
ValveView valve_view(std::span<const double> pv, std::span<const double> co, double band);

}  // namespace loopwarden::workbench
