// SPDX-License-Identifier: Apache-2.0
// Compares gains on the disturbance and the set points of one record.
//
//   d(k) = PV(k) - PV of the model for the recorded CO
//   the closed loop of the model, with d added to its PV, is simulated with each of the gains
//
// So neither another load nor other set points are taken for an improvement.
// Figures: `loopwarden-study receipt --gains` (lab/results/diagnose.md).
//
// Limits: valve effects are left out, and so are limits of CO that the model does not have. An
// error of the model is part of d, so gains far from those of the record are compared less exactly.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "model/control/tuning.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::analysis {

// Returns the RMS of SP - PV with each of the gains, PV units. `record`: complete, in automatic.
// nullopt if it has no SP or fewer than 100 samples, or if a simulation does not stay finite.
std::optional<std::array<double, 2>> compare_gains(const numeric::LoopView& record,
                                                   const plant::LoopModel& model,
                                                   const std::array<control::PidGains, 2>& gains);

struct GainLimits {
  static constexpr double kAlike = 0.9;      // ratio of two RMS, from which they differ
  static constexpr double kModelFits = 1.3;  // ratio of simulated and measured RMS, at most
};

enum class GainResult : std::uint8_t { improved, worse, no_difference, cant_tell };
const char* to_text(GainResult result) noexcept;

struct GainChange {
  GainResult result = GainResult::cant_tell;
  std::string why;
};

// One record, before or after a change of the gains.
struct GainRecord {
  double rms = 0.0;  // of SP - PV, measured, PV units
  // Of compare_gains() with the gains before and after the change; empty: no model, or no result.
  std::optional<std::array<double, 2>> by_model{};
};

// The disturbances of both records must give the same answer.
GainChange judge_gains(const GainRecord& before, const GainRecord& after);

}  // namespace loopwarden::analysis
