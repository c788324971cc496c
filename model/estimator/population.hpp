// SPDX-License-Identifier: Apache-2.0
// One population searches one hypothesis: it gives the likelihood, samples for intervals, and a
// representative.
//
// Members are points of the unit cube. The likelihood is switched on by degrees (sequential Monte
// Carlo): weights by L^(db) keep a share of the members effective, the members are drawn again by
// weight, and each then moves by Metropolis steps at the present degree:
//   2 of 5  normal, with the covariance of the population
//   2 of 5  difference of two other members (differential evolution)
//   1 of 5  another actuator, or as the line above
// At a new place other sizes of the error are tried, which costs no further free run.
// Source: Del Moral, Doucet and Jasra, J. Royal Statistical Society B 68 (2006) 411-436; ter Braak,
// Statistics and Computing 16 (2006) 239-249.
//
// The random numbers depend on the seed only, so the same hypothesis gives the same bits on any
// number of threads.
#pragma once

#include <cstdint>
#include <vector>

#include "model/estimator/likelihood.hpp"

namespace loopwarden::estimator {

struct Member {
  std::vector<double> z;
  double log_likelihood = 0.0;
};

// Where the first members are drawn: a share around a place, the others anywhere.
struct Start {
  std::vector<double> mean{};
  std::vector<double> deviation{};
  double share = 0.0;

  // Around the members of a population, `wider` times as wide and at least `least`.
  static Start around(const std::vector<Member>& members, std::size_t best, double wider,
                      double least, double share);
};

struct Effort {
  std::size_t members = 48;
  int moves = 2;           // per member and degree
  std::size_t first = 4;   // draws per member
  std::size_t climbs = 0;  // steps uphill from the best member
};

struct Population {
  std::vector<Member> members;
  std::size_t best = 0;

  const Member& top() const noexcept { return members[best]; }
};

// The member with better sizes of the error, by steps to the neighbours on the grid.
Member with_best_error(const Likelihood& likelihood, const Hypothesis& hypothesis, Member member,
                       Likelihood::Work& work);

Population search(const Likelihood& likelihood, const Hypothesis& hypothesis, const Start& start,
                  const Effort& effort, std::uint64_t seed, Likelihood::Work& work);

}  // namespace loopwarden::estimator
