// SPDX-License-Identifier: Apache-2.0
// What `diagnose` says of a loop: JSON, text and a page with pictures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::workbench {

struct DiagnosedWindow {
  std::string file;
  double from_s = 0.0;  // in the time of its file
  double to_s = 0.0;
  double period_s = 1.0;
  diagnosis::Diagnosis diagnosis;
};

struct DiagnosedLoop {
  std::vector<DiagnosedWindow> windows;  // in the order given
  diagnosis::LoopVerdict verdict;
  std::vector<double> co_range;  // CO units, lower and upper end
};

// When the samples that the diagnosis used were taken, s: what gates cut off at the front counts.
std::vector<double> sample_times(const DiagnosedWindow& window);

nlohmann::json diagnosis_json(const DiagnosedLoop& loop);
std::string diagnosis_text(const DiagnosedLoop& loop);
// Trend with the stuck stretches marked, and PV over CO with the fitted band, for every window.
std::string diagnosis_page(const DiagnosedLoop& loop);

}  // namespace loopwarden::workbench
