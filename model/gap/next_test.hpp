// SPDX-License-Identifier: Apache-2.0
// Plans the smallest move that tells the likely explanations of a record apart, for `gap` and for
// the explanation of an alarm (estimator/plan.hpp).
//
// Steps and ramps of the disturbance that have ended are a new level, which a test ignores.
// Errors: none. Without a second likely explanation nothing is planned.
#pragma once

#include <vector>

#include "model/estimator/estimate.hpp"
#include "model/estimator/plan.hpp"
#include "model/gap/result.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::gap {

// `posterior`: of the explanations that `found` has as models, likeliest first. `start`: as of
// test_start(). Sets `next_test` or `why_no_test` of the result.
void plan_next_test(const estimator::Estimate& found, const std::vector<Probability>& posterior,
                    estimator::TestStart start, const numeric::ParallelFor& parallel,
                    Result& result);

// The loop as it was last. `disturbance` is still to be set.
estimator::TestStart test_start(const plant::LoopModel& model, double set_point, double output);

}  // namespace loopwarden::gap
