// SPDX-License-Identifier: Apache-2.0
// From records of a loop that works, and a rough model or none, to its twin: the loop model that
// the records can't tell from the plant.
//
//   usable     compression, manual, clamped output, movement, length                            usable.hpp
//   process    identified from the record (analysis/identification.hpp), or the given one; what fits better starts
//   gap        with the process free within wide bounds, again and again until nothing is missing  gap/workflow.hpp
//   healthy    friction, play and the width of a hysteresis up to the limit are the twin's; a valve fault is none
//   twin       process, effects, controller, noise and load as found; the day's own disturbances left out
//   sure       covariance of the process                                                        twin_fit.hpp
//
// The first record makes the twin; each further one must agree with it.
//
//   gap closed = (before^2 - after^2)/(before^2 - floor^2), of the last third's rmse, PV units; before: the model as
//   given or, where none was given, as identified
//
// Errors: effects::EffectError for a given model that can't be stepped.
// What it can't do: loops whose controller moves CO by another law than PI(D), gains scheduled over
// the range, a healthy valve with more friction than the limit.
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
