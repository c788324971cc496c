// SPDX-License-Identifier: Apache-2.0
// Explains an alarm: the change of the twin that the newest record shows.
//
//   stretch     at most kLongest_s before the alarm; of it, what lies behind the moment from which on a change of the kind
//               that leads in the watch, else one of the controller, is hardly less likely than from the likeliest moment; and
//               what comes after the alarm, as far as the record goes, until there are `enough_s`
//   name        the estimator's competition of effects about the twin, its posterior as prior. Each
//               effect acts from a moment between those on (estimator/since.hpp); the stretch is
//               fitted together with some healthy minutes before it. Of the stretch two thirds are
//               fitted, the last third proves
//   controller  its settings, from SP and PV to CO in the stretch (gap/controller.hpp)
//   agreement   an effect agrees with an alarm of its own name, and with others as its descriptor says; every effect
//               agrees with model_gap
//   final name  if no effect agrees and the first one gives its name (alarm/given_name.hpp):
//               of a valve effect its own alarm, otherwise model_gap
//   left out    PV where the twin may not judge: from beyond the commissioned range until its
//               samples count again (twin_watch.hpp). The record begins with the first other PV.
//               It is not usable if more than half of the samples are left out
//
// Errors: none: a stretch that can't be used is not explained.
// What it can't do: two changes at different times within the stretch.
//
// Source of the moment: Basseville and Nikiforov, Detection of Abrupt Changes (1993), ch. 2
// (likelihood of a change, two variances).
#pragma once

#include <optional>

#include "model/gap/record.hpp"
#include "model/gap/result.hpp"
#include "model/numeric/parallel.hpp"
#include "model/alarm/alarm_kind.hpp"

namespace loopwarden::twin {

inline constexpr double kLongest_s = 1800.0;
inline constexpr double kEnough_s = 600.0;     // for a first explanation
inline constexpr double kMostSeen_s = 2400.0;  // for the last
inline constexpr double kBefore_s = 900.0;     // of the twin as it was, before the stretch

struct ExplainSettings {
  double enough_s = kEnough_s;
  // Whether the twin's controller is the loop's. Not where this program has the loop: gains, jacket
  // and compensator are its own, and none of them is a change.
  bool judge_controller = true;
};

struct TellingStretch {
  gap::SampleRange range;
  std::size_t latest = 0;  // sample after which no change began
};
// Of the record, for an alarm at sample `alarm`.
TellingStretch telling_stretch(const numeric::LoopRecord& record, const plant::LoopModel& twin,
                               std::size_t alarm, const ExplainSettings& settings);

struct Explanation {
  gap::SampleRange stretch;
  std::size_t at = 0;       // sample at which the change began, as far as is known
  gap::SampleRange from{};  // at which it may have begun, both ends; both 0: not known
  gap::Result result;
  // Share of the gap, as its source has it; NaN: too near to the noise floor to say.
  double closed = gap::kNone;
  bool usable() const noexcept { return result.check.usable; }
};
Explanation explain(const numeric::LoopRecord& record, const plant::LoopModel& twin,
                    std::size_t alarm, const ExplainSettings& settings,
                    const numeric::ParallelFor& parallel);

bool agrees(const Explanation& explanation, alarm::AlarmKind alarm);
// Nothing: the alarm keeps its name.
std::optional<alarm::AlarmKind> final_name(const Explanation& explanation, alarm::AlarmKind alarm);
// Of the effect that gives the final name, % of the CO span; 0 where it has no size.
double size_percent(const Explanation& explanation);

}  // namespace loopwarden::twin
