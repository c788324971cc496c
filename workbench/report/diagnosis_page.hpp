// SPDX-License-Identifier: Apache-2.0
// `diagnose --report`: a page with pictures.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "workbench/text/diagnose_text.hpp"

namespace loopwarden::workbench {

// When the samples that the diagnosis used were taken, s: what gates cut off at the front counts.
std::vector<double> sample_times(const DiagnosedWindow& window);

// Trend with the stuck stretches marked, and PV over CO with the fitted band, for every window.
std::string diagnosis_page(const DiagnosedLoop& loop);

// What a valve with this band does behind CO, for the pictures. PV comes later than the valve, by the process' dead time and lag:
// so the stretches in which the valve stands are marked on CO, and PV is drawn behind both, as they fit best.
struct ValveView {
  std::vector<double> standing;  // CO where it moves and the valve does not, else NaN
  std::vector<double> followed;  // PV units, NaN before the dead time
  std::size_t dead_time = 0;     // samples
};
ValveView valve_view(std::span<const double> pv, std::span<const double> co, double band);

}  // namespace loopwarden::workbench
