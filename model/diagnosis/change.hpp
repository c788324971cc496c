// SPDX-License-Identifier: Apache-2.0
// Judges a change that is no repair, such as new gains or another positioner: is SP - PV smaller?
//
// With a model of the loop, both gains are compared on the disturbance of each record
// (analysis/gain_comparison.hpp), so another load or another set point is no improvement.
// Without it, the records are compared directly. The change of the RMS must then be larger than its
// spread within the records, the set points must move alike, and the result must hold for the RMS
// in units of the disturbance and noise, too.
// Figures: `loopwarden-study receipt --gains` (lab/results/diagnose.md).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/numeric/loop_record.hpp"

namespace loopwarden::diagnosis {

struct ChangeLimits {
  static constexpr double kByModel = 0.9;    // ratio of RMS from which a change counts
  static constexpr double kByRecords = 0.7;  // the same without a model
  static constexpr double kSetPoints = 1.5;  // ratio of two like movements of SP, at most
  static constexpr double kModelFits = 1.3;  // ratio of simulated and measured RMS, at most
};

enum class ChangeResult : std::uint8_t { improved, worse, no_difference, cant_tell };
const char* to_text(ChangeResult result) noexcept;

struct Change {
  ChangeResult result = ChangeResult::cant_tell;
  std::string why;
};

// One record, before or after the change.
struct ChangeSide {
  numeric::LoopView record;  // complete, in automatic
  double rms = 0.0;          // of SP - PV, PV units
  double unpredicted = 0.0;  // of repair.hpp, PV units
  // RMS with the gains before and after the change on the disturbance of this record; empty: no
  // model.
  std::optional<std::array<double, 2>> by_model{};
};

Change judge_change(const ChangeSide& before, const ChangeSide& after);

}  // namespace loopwarden::diagnosis
