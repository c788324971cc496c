// SPDX-License-Identifier: Apache-2.0
// Gains for a loop by the rules of `loopwarden tune`, beside those in force: margins and simulated answers of each, on the loop's
// twin or on a process identified from its record. Pure; a few tens of milliseconds, an identification some hundred.
//
// The answers are of the linear loop at mid range, with the loop's own limits of CO: mid CO is taken to hold PV at mid
// range. A model is simulated in steps of its sample time, or of a 20 000th of the time watched where that is more.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/identification.hpp"
#include "model/analysis/rule_trial.hpp"
#include "services/page/tuning/step_record.hpp"

namespace loopwarden::page::tuning {

// What the loop is known to be.
struct LoopFacts {
  double sample_time_s = 0.1;
  std::array<double, 2> pv_range{0.0, 100.0};       // PV units
  std::array<double, 2> output_limits{0.0, 100.0};  // CO units
  control::PidGains gains;                          // in force
};

// The process found in a record; without a model where it can't be told.
struct Identified {
  std::optional<plant::LoopModel> model;
  std::string why_not, settle;  // sentences
  double fit_percent = 0.0;
  std::array<double, 2> gain{}, time_constant_s{}, dead_time_s{};  // intervals, 95 %
  std::vector<std::string> notes;
};
Identified identified(const StepRecord& record, const LoopFacts& loop);

// The twin as it may be simulated here.
plant::LoopModel model_of(plant::LoopModel twin, const LoopFacts& loop);

struct Proposal {
  std::vector<analysis::RuleTrial> trials;  // the gains in force first
  std::optional<std::size_t> recommended;   // of `trials`
};
// Gains of the rules have four digits, as they are shown and set. PID: only where the loop filters its derivative, since an
// order does not change the filter.
Proposal propose(const plant::LoopModel& model, const LoopFacts& loop,
                 analysis::ControllerForm form);

}  // namespace loopwarden::page::tuning
