// SPDX-License-Identifier: Apache-2.0
// The competition of hypotheses: the model without an effect, with one, two and three.
//
//   1. The model without an effect. Its posterior starts the healthy valve of every other one.
//   2. Every effect of the catalogue separately. Disturbances and stiction start from statistics of
//      the record (starts.hpp). The best ones are searched again from their own posterior.
//   3. Pairs grow from the best singles: every other effect is tried at a few values next to the
//      posterior of the single, and the best are searched. Triples grow from the best pair.
//   4. Step back: each part of the best pair is searched again from the posterior of the pair, so
//      that no part loses because its own search was worse.
//
// The score of a hypothesis is its best log-likelihood without the penalty of Schwarz (1978) for
// its parameters, and without the handicap of rare effects:
//   score = log L - p/2 ln n - handicap        n  blocks of the record
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/estimator/population.hpp"
#include "model/estimator/slips.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::estimator {

struct Fit {
  Hypothesis hypothesis;
  Population population;
  Solution solution;  // at the best member
  double score = 0.0;

  double log_likelihood() const noexcept { return population.top().log_likelihood; }
};

// Of the best member.
double score_of(const Fit& fit, const Likelihood& likelihood);

struct Competition {
  std::vector<Fit> fits;  // best score first; `none` is among them
  std::size_t evaluations = 0;

  const Fit& none() const;
};

Competition compete(const Likelihood& likelihood, const std::vector<Law>& laws, const Slips& slips,
                    std::size_t most_effects, const numeric::ParallelFor& parallel,
                    const std::function<void(double)>& progress = {});
// Adds further laws, each separately.
void add_laws(Competition& competition, const Likelihood& likelihood, const std::vector<Law>& laws,
              const Slips& slips, const numeric::ParallelFor& parallel);

}  // namespace loopwarden::estimator
