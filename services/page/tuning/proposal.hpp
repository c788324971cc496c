// SPDX-License-Identifier: Apache-2.0
// Proposes gains for a loop by the rules of `loopwarden tune`: margins and simulated responses of
// each, and of the gains in force, on the loop's twin or on a process identified from its record.
// Pure. Takes a few tens of milliseconds, an identification some hundred.
//
// Responses are those of the linear loop at mid range, with the loop's own limits of CO. Mid-range
// CO is assumed to give mid-range PV. A model is simulated in steps of its sample time, or of
// 1/20000 of the simulated time if that is larger.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/identification.hpp"
#include "model/analysis/rule_trial.hpp"
#include "services/page/tuning/step_record.hpp"

namespace loopwarden::page::tuning {

// The known facts about the loop.
struct LoopFacts {
  double sample_time_s = 0.1;
  std::array<double, 2> pv_range{0.0, 100.0};       // PV units
  std::array<double, 2> output_limits{0.0, 100.0};  // CO units
  control::PidGains gains;                          // in force
};

// The process found in a record; without a model if it can't be identified.
struct Identified {
  std::optional<plant::LoopModel> model;
  std::string why_not, settle;  // sentences
  double fit_percent = 0.0;
  std::array<double, 2> gain{}, time_constant_s{}, dead_time_s{};  // intervals, 95 %
  std::vector<std::string> notes;
};
Identified identified(const StepRecord& record, const LoopFacts& loop);

// Returns the twin in a form that can be simulated here.
plant::LoopModel model_of(plant::LoopModel twin, const LoopFacts& loop);

struct Proposal {
  std::vector<analysis::RuleTrial> trials;  // the gains in force first
  std::optional<std::size_t> recommended;   // of `trials`
};
// Gains of the rules have four digits, as they are shown and set. PID: only if the loop filters its
// derivative, because a command does not change the filter.
Proposal propose(const plant::LoopModel& model, const LoopFacts& loop,
                 analysis::ControllerForm form);

}  // namespace loopwarden::page::tuning
