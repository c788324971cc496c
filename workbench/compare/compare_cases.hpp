// SPDX-License-Identifier: Apache-2.0
// Compares every compensator with the same loop without one, on a grid of valve faults, severities,
// plants, noise levels and set-point moves.
//
//   faults      stiction with J = 0.3 S and with J = S, backlash, hysteresis (width), no fault
//   severities  2, 5 and 10 % of the CO range
//   plants      the model's plant with its settings; the study adds four times its lag and twice
//               its dead time, both tuned by the lambda rule
//   noise       0 and 0.1 % of the PV range
//   set points  50, 52, 60 and 55 % of the PV range, each held for 350 (T + L)
//
// Compensators are sized by `estimate` times the true severity. The jacket has the true stem as
// read-back. Measures use SP - true PV. "Settled" leaves out the first third of each set point.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/analysis/loop_metrics.hpp"
#include "model/plant/loop_model.hpp"
#include "model/analysis/loop_trial.hpp"

namespace loopwarden::workbench {

struct Contender {
  std::string name;
  std::function<void(control::ControllerSettings&)> fit;  // switches it on
};

struct CompareCase {
  std::string fault;
  double percent = 0.0;  // of the CO range
  std::string plant;
  double noise = 0.0;      // PV units
  plant::LoopModel model;  // without compensator
  double hold_s = 0.0;
};

struct CompareResult {
  double variability = 0.0;         // RMS of settled SP - PV, PV units
  double absolute_error = 0.0;      // integral of |SP - PV| over the whole run, PV units s
  double amplitude = 0.0;           // of the settled PV, mean over set points, PV units
  double period_s = 0.0;            // 0: does not cycle
  double overshoot = 0.0;           // mean over the moves, share of the move
  double mean_error = 0.0;          // mean over set points of |mean settled SP - PV|, PV units
  double travel_per_hour = 0.0;     // CO units / h
  double reversals_per_hour = 0.0;  // 1 / h
};

enum class ComparedPlants { own, own_and_others };
std::vector<CompareCase> compare_cases(const plant::LoopModel& model, ComparedPlants plants);
// Returns the compensators to compare. The first one is named "none" and has no compensator.
std::vector<Contender> contenders(const CompareCase& one, double estimate);
CompareResult compare_one(const CompareCase& one, const Contender& contender);

}  // namespace loopwarden::workbench
