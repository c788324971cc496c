// SPDX-License-Identifier: Apache-2.0
// Compares the records of a loop before and after work at its valve: was the effect removed?
//
//   repaired      the record before shows a valve effect; the record after shows no effect, and it
//                 excludes a band of at least half the size
//   not repaired  the record after shows a valve effect of at least half the size
//   can't tell    all others, with the reason
//
// The band is found without a model of the loop (estimator/band.hpp), so load and set points may
// differ. Figures: `loopwarden-study receipt` (lab/results/diagnose.md).
// Limits: a controller in manual, or a CO that doesn't move, shows nothing.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::diagnosis {

struct RepairLimits {
  static constexpr double kHalf = 0.5;  // of the size before
  // Nats, if the record after is judged healthy or names another cause, and if it is undecided.
  // Figures: loopwarden-study receipt.
  static constexpr double kExcluded = 6.0;
  static constexpr double kExcludedUndecided = 20.0;
  static constexpr double kSameDisturbance = 1.5;  // ratio of two equal disturbances, at most
};

enum class RepairResult : std::uint8_t { repaired, not_repaired, cant_tell };
const char* to_text(RepairResult result) noexcept;

struct Repair {
  RepairResult result = RepairResult::cant_tell;
  std::string why;
  Diagnosis before, after;     // the windows most like their verdicts
  double excluded_nats = 0.0;  // by which the record after excludes half of the band before
};

// Judges the windows of both records, each in the order of time.
Repair judge_repair(std::span<const Diagnosis> before, std::span<const Diagnosis> after);

// Returns the standard deviation of PV that PV and CO of the samples before don't predict: the
// disturbance and the noise of one sample. PV units; NaN if there are too few samples. Outliers,
// such as the slips of a valve, have little effect.
double unpredicted(std::span<const double> pv, std::span<const double> co);

}  // namespace loopwarden::diagnosis
