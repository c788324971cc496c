// SPDX-License-Identifier: Apache-2.0
// Makes the twin of a loop from healthy records and a rough model or none: the loop model that the
// records can't distinguish from the plant. docs/math/estimator.md, "Twin".
//
//   usable          compression, manual, clamped output, movement, length (usable.hpp)
//   process         the given model or an identified one; a rough one is searched first, then gain,
//                   lag, dead time and level are fitted (process_fit.hpp)
//   effects         the estimator's competition about this process, in rounds, until no effect is
//                   missing. Friction, backlash and hysteresis up to the limit belong to the twin;
//                   a valve fault refuses the record; disturbances of the day are left out
//   characteristic  and friction of a healthy valve, if they explain clearly more
//   twin            the fit of the whole record: means and covariance of the process, noise,
//                   disturbance, and what the watches reach in the record
//
// The first record makes the twin; each further one must agree with it.
//   gap closed = (before^2 - after^2)/(before^2 - floor^2), rmse of the last third, PV units;
//   before: the model as given or as identified
//
// Errors: effects::EffectError for a given model that can't be stepped.
// Limits: controllers with another law than PI(D), gains scheduled over the range, a healthy valve
// with more friction than the limit.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/identification.hpp"
#include "model/gap/result.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::twin {

enum class Outcome : std::uint8_t {
  commissioned,
  not_enough_movement,
  not_healthy,
  not_explained,
  not_usable
};
const char* to_text(Outcome outcome) noexcept;

// Less of the gap closed, and the twin is none.
inline constexpr double kLeastClosed = 0.9;
// The process as a gap may move it here, relative: a rough belief, and one that was identified
// under what the valve and the day's disturbances did to it.
inline constexpr plant::ProcessUncertainty kRoughBelief{
    .gain = 0.5, .time_constant = 0.6, .dead_time = 0.8};
inline constexpr plant::ProcessUncertainty kIdentified{
    .gain = 0.3, .time_constant = 0.3, .dead_time = 0.3};
// About the process that was fitted.
inline constexpr plant::ProcessUncertainty kAbout{
    .gain = 0.1, .time_constant = 0.1, .dead_time = 0.1};
inline constexpr int kMostRounds = 3;

struct Request {
  std::vector<numeric::LoopRecord> records;  // at least one
  std::optional<plant::LoopModel> model;
  double healthy_limit_percent = 1.0;  // of the CO span
  bool accept_short = false;           // short records, and those without CO
  analysis::KnownRanges ranges{};      // where there is no model
};

// The model after a step on the way to the twin.
struct Stage {
  std::string name;                  // "as given", "process", an effect, ...
  double rmse = gap::kNone;          // PV units, first two thirds
  double holdout_rmse = gap::kNone;  // PV units, last third
  std::vector<double> pv;            // PV units, free run
};

struct Commissioning {
  Outcome outcome = Outcome::not_usable;
  std::string why;  // a sentence
  std::vector<std::string> accepted;
  std::vector<std::string> notes;
  plant::LoopModel given;  // what it started from: the model, or what was assumed
  bool identified = false;
  plant::LoopModel twin;
  std::vector<gap::FoundEffect> effects;  // what `given` lacked
  // Of the twin and the first record: what is left, with `before` of `given`.
  std::optional<gap::Result> gap;
  double closed = gap::kNone;
  std::vector<Stage> stages;
};

Commissioning commission(const Request& request, const numeric::ParallelFor& parallel,
                         const std::function<void(double)>& progress);

// % of the CO span that a valve fault of this size takes; NaN for what has no size.
double size_percent(const effects::EffectSpec& spec, double co_span);

}  // namespace loopwarden::twin
