// SPDX-License-Identifier: Apache-2.0
// PV of a whole model as it stands, and how far it is from the record: what gap.json's `before` and
// `after` are made of. Nothing is fitted but the unknown state at the first sample.
//
//   rmse = sqrt(mean (measured - simulated)^2)         over the samples that count, PV units
//   fit  = 100 (1 - rmse / standard deviation of the measured PV), %; none below three noise floors
//
// What it can't do: a record that starts in the middle of a slip has a state that a place of the
// stem and two numbers of the process describe only nearly.
#pragma once

#include <vector>

#include "model/gap/free_run.hpp"
#include "model/gap/record.hpp"
#include "model/gap/result.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

// Of a - b over the samples used; NaN where there are none.
double rms_between(const std::vector<double>& a, const std::vector<double>& b,
                   const std::vector<bool>& used, SampleRange range);

// `floor` is the noise floor, PV units.
Misfit misfit_of(const std::vector<double>& pv, const std::vector<double>& simulated,
                 const std::vector<bool>& used, double floor);

// PV of the model's closed loop, driven by SP, from the measured first PV. Noise left out.
std::vector<double> closed_loop(const plant::LoopModel& model, const std::vector<double>& sp,
                                double first_pv);

// PV of the model driven by `co`, as its transmitter shows it, from the samples where `measured`.
// The state at the start is fitted to the first two thirds, and so is the level unless it is the
// model's. A stem's place is fitted from a grid and, if one is known already, `start_offset` (CO
// units below CO).
std::vector<double> free_run(const plant::LoopModel& model, const std::vector<double>& co,
                             const std::vector<double>& pv, const std::vector<bool>& measured,
                             double start_offset = 0.0, Level level = Level::of_model);

}  // namespace loopwarden::gap
