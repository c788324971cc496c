// SPDX-License-Identifier: Apache-2.0
// Limits a diagnosis if an archive kept only a part of the samples. Between two stored values a
// signal is known only within a deviation (analysis/archive.hpp).
//
//   sees from = 2 max(deviation of CO, deviation of PV / gain)      CO units
//
// gain: range of PV over range of CO, 5 to 95 %. A band of that width fits into the omitted
// movement, and a narrower one is invisible. The verdict then becomes:
//
//   a valve effect smaller than that                                         can't tell
//   healthy, or another cause, if a band of 3 % of the span, or of three
//   tenths of CO's range, could hide                                         can't tell
//
// Limits: it only bounds the lost movement. The deviations are estimates within a factor of two.
#pragma once

#include <span>

#include "model/analysis/archive.hpp"
#include "model/diagnosis/diagnosis.hpp"

namespace loopwarden::diagnosis {

struct Archived {
  analysis::ArchivedSignal pv, co;

  bool any() const noexcept {
    return pv.kind != analysis::ArchiveKind::none || co.kind != analysis::ArchiveKind::none;
  }
};

// Returns the detection limit in CO units. 0: the archive omitted no value; infinite: a deviation
// is unknown.
double sees_from(std::span<const double> pv, std::span<const double> co, const Archived& archived);

// Returns whether the archive hides the result of one window, or of a loop with the size of its
// effect. `co_moves`: range of CO, 5 to 95 %.
bool hidden(DiagnosisVerdict verdict, Cause cause, double size, double sees_from, double co_moves,
            double co_span);
void mind_archive(Diagnosis& diagnosis, double sees_from, double co_span);
// Limits the verdict of all windows in the same way: an effect that the archive hides in the
// windows is hidden from their common verdict too. `like`: the window that represents the loop.
void mind_archive(LoopVerdict& verdict, const Diagnosis& like, double sees_from, double co_span);

// The reason and the remedy in that case.
inline constexpr const char* kHiddenReason =
    "the archive omitted values, and an effect may be hidden between the stored ones";
inline constexpr const char* kHiddenSettle =
    "an hour of the loop read directly (OPC, the controller's own trend), or a smaller compression "
    "deviation";

}  // namespace loopwarden::diagnosis
