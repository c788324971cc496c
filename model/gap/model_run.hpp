// SPDX-License-Identifier: Apache-2.0
// PV of a model as given, and its error: `before` and `after` of gap.json. Only the unknown state at
// the first sample is fitted.
//
//   rmse = sqrt(mean (measured - simulated)^2)         over the counted samples, PV units
//   fit  = 100 (1 - rmse / standard deviation of the measured PV), %; none below three noise floors
//
// Limit: a record that starts in the middle of a slip has a state that a position of the stem and
// two numbers of the process describe only nearly.
#pragma once

#include <vector>

#include "model/gap/record.hpp"
#include "model/gap/result.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

// Of a - b over the samples used; NaN where there are none.
double rms_between(const std::vector<double>& a, const std::vector<double>& b,
                   const std::vector<bool>& used, SampleRange range);

// `fitted`: samples of the training part; `floor`: the noise floor, PV units.
Misfit misfit_of(const std::vector<double>& pv, const std::vector<double>& simulated,
                 const std::vector<bool>& used, std::size_t fitted, double floor);

// PV of the model's closed loop, driven by SP, from the measured first PV. Noise left out.
std::vector<double> closed_loop(const plant::LoopModel& model, const std::vector<double>& sp,
                                double first_pv);

// PV of the model driven by `co`. The state at the start is fitted to the samples where `measured`;
// a stem that sticks starts where it leaves least on the first two thirds.
std::vector<double> free_run(const plant::LoopModel& model, const std::vector<double>& co,
                             const std::vector<double>& pv, const std::vector<bool>& measured);

}  // namespace loopwarden::gap
