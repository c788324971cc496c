// SPDX-License-Identifier: Apache-2.0
// Judges a loop's explanations by its record and a later test of them (plan.hpp) together.
//
// The estimator fits both records, joined to one (blocks.hpp), with all names. Nothing is held out:
// the question is which explanation is right, not whether it is good.
//
//   P(explanation) = probability of its hypotheses / probability of all hypotheses of the catalogue
//
// A hypothesis with all effects of an explanation, and more, counts for it.
// Limits: what disturbs the loop between the records is taken to go on at random. The test should
// start with a few answer times before the move, at about the output at which the record ends.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/estimator/blocks.hpp"
#include "model/estimator/estimate.hpp"
#include "model/numeric/parallel.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::estimator {

inline constexpr double kRest = 20.0;  // answer times between the records

// The probabilities with these indices, with the sum 1.
std::vector<double> among(const std::vector<double>& probability,
                          const std::vector<std::size_t>& index);

struct Judged {
  std::vector<double> probability;           // of each explanation, after both records
  std::vector<std::string> likeliest_other;  // effects of the likeliest hypothesis besides them
  double other = 0.0;                        // probability of all hypotheses besides them
  bool explained = false;  // the likeliest hypothesis explains both records down to the floor
  // Index of the explanation that reaches kDecides and explains the records; -1: undecided.
  int decided = -1;
};

// `explanations`: effects of each; an empty one: nothing is missing. `model`, `options`: of the
// estimate that gave them.
Judged judge_test(const std::vector<std::vector<std::string>>& explanations, const Observed& record,
                  const Observed& test, const plant::LoopModel& model, Options options,
                  const numeric::ParallelFor& parallel);

}  // namespace loopwarden::estimator
