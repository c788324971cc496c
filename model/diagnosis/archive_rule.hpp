// SPDX-License-Identifier: Apache-2.0
// What a diagnosis is worth where an archive kept only a part of the samples: between two stored values a signal is
// known to a deviation only (analysis/archive.hpp).
//
//   sees from = 2 max(deviation of CO, deviation of PV / gain)      CO units
//
// gain: range of PV over range of CO, 5 to 95 %. A band of that width passes within what was left out; narrower ones
// can't be seen. Then:
//
//   a valve effect smaller than that                                         can't tell
//   by exception: a valve effect that the play does not show                 can't tell
//     (a held value is a small sticking valve itself: step by step it foretells PV better)
//   healthy, or another cause, where a band of 3 % of the span, or of three
//   tenths of what CO moves, could hide                                      can't tell
//
// Limits: it can't more than bound what was lost; the deviations are estimates within a factor of two.
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

inline constexpr double kHideAllPercent = 3.0;    // of the CO span
inline constexpr double kHideShareOfMoves = 0.3;  // of the range of CO

// CO units; 0: nothing was left out; infinite: a deviation is not known.
double sees_from(std::span<const double> pv, std::span<const double> co, const Archived& archived);

// Of one window, or of a loop with the size of its effect. `co_moves`: range of CO, 5 to 95 %.
bool hidden(DiagnosisVerdict verdict, Cause cause, double size, double sees_from, double co_moves,
            double co_span);
void mind_archive(Diagnosis& diagnosis, const Archived& archived, double sees_from, double co_span);
// The windows' evidence together decides; what an archive hides it hides from that as well. `like`: the window that stands
// for the loop.
void mind_archive(LoopVerdict& verdict, const Diagnosis& like, const Archived& archived,
                  double sees_from, double co_span);

// What is said then.
inline constexpr const char* kHiddenReason =
    "what the archive left out between the stored values hides it";
inline constexpr const char* kHiddenSettle =
    "an hour of the loop read directly (OPC, the controller's own trend), or a smaller compression "
    "deviation";

}  // namespace loopwarden::diagnosis
