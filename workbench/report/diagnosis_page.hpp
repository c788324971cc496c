// SPDX-License-Identifier: Apache-2.0
// `diagnose --report`: a page with pictures.
#pragma once

#include <string>
#include <vector>

#include "workbench/text/diagnose_text.hpp"

namespace loopwarden::workbench {

// When the samples that the diagnosis used were taken, s: what gates cut off at the front counts.
std::vector<double> sample_times(const DiagnosedWindow& window);

// Trend with the stuck stretches marked, and PV over CO with the fitted band, for every window.
std::string diagnosis_page(const DiagnosedLoop& loop);

}  // namespace loopwarden::workbench
