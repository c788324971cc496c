// SPDX-License-Identifier: Apache-2.0
// What `diagnose` says of a loop, as JSON and as text.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "record/import/constant_period.hpp"
#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::workbench {

struct DiagnosedWindow {
  std::string file;
  double from_s = 0.0;  // in the time of its file
  double to_s = 0.0;
  double period_s = 1.0;
  std::size_t import = 0;  // of DiagnosedLoop::imports
  diagnosis::Diagnosis diagnosis;
  double sees_from = 0.0;  // CO units, smallest effect that shows; 0: an archive left nothing out
};

struct DiagnosedLoop {
  std::vector<DiagnosedWindow> windows;  // in the order given
  diagnosis::LoopVerdict verdict;
  std::vector<double> co_range;                // CO units, lower and upper end
  std::vector<record::ImportNotes> imports{};  // of each record
  // Loops that push it, the strongest first; nothing where none of one time base was given.
  std::optional<std::vector<std::string>> pushed_by{};
};

// A time of a window's file: by the clock of the plant where its export has one, else in s.
std::string time_text(const DiagnosedLoop& loop, const DiagnosedWindow& window, double time_s);
// Of PV or CO as the export calls it, else `otherwise`.
std::string unit_text(const DiagnosedLoop& loop, const DiagnosedWindow& window, record::Role role,
                      const char* otherwise);
// The verdict in one line.
std::string headline(const diagnosis::Diagnosis& d, const std::vector<double>& co_range);
nlohmann::json diagnosis_json(const DiagnosedLoop& loop);
std::string diagnosis_text(const DiagnosedLoop& loop);

}  // namespace loopwarden::workbench
