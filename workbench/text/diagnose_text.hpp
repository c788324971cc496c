// SPDX-License-Identifier: Apache-2.0
// Writes the result of `diagnose` for one loop as JSON and as text.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "record/import/constant_period.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/deciding_test.hpp"

namespace loopwarden::workbench {

struct DiagnosedWindow {
  std::string file;
  double from_s = 0.0;  // in the time of its file
  double to_s = 0.0;
  double period_s = 1.0;
  std::size_t import = 0;  // index in DiagnosedLoop::imports
  diagnosis::Diagnosis diagnosis;
  double sees_from = 0.0;  // CO units, smallest visible effect; 0: the archive has all values
};

struct DiagnosedLoop {
  std::vector<DiagnosedWindow> windows;  // in the given order
  diagnosis::LoopVerdict verdict;
  std::vector<double> co_range;                // CO units, lower and upper end
  std::vector<record::ImportNotes> imports{};  // of each record
  // Loops that disturb it, strongest first. nullopt: no other loop had the same time base.
  std::optional<std::vector<std::string>> pushed_by{};
  std::optional<diagnosis::DecidingTest> test{};  // of a likely or undecided valve
  std::string master{};  // tag of the loop that writes its set point; empty: none is known
};

// Returns a time of a window's file: by the plant's clock if the export has one, otherwise in s.
std::string time_text(const DiagnosedLoop& loop, const DiagnosedWindow& window, double time_s);
// Returns the unit of PV or CO in the export, or `otherwise` if the export has no unit.
std::string unit_text(const DiagnosedLoop& loop, const DiagnosedWindow& window, record::Role role,
                      const char* otherwise);
// Returns the verdict in one line.
std::string headline(const diagnosis::Diagnosis& d, const std::vector<double>& co_range);
nlohmann::json diagnosis_json(const DiagnosedLoop& loop);
std::string diagnosis_text(const DiagnosedLoop& loop);

}  // namespace loopwarden::workbench
