// SPDX-License-Identifier: Apache-2.0
// Differential evolution: finds the minimum of a function that has jumps and many valleys.
//
//   trial = own, but in some places  from + reach (a - b),   cut to 0 ... 1
//
//   own    the member that the trial may replace
//   from   the best member in half of the trials, otherwise own or any member (settings)
//   a, b   any members
//   reach  drawn again for each trial; 0.4 to 0.9 is usual
//
// A place is one coordinate of a member, 0 to 1; the caller maps its ranges onto it. One place,
// drawn at random, always changes; every other place changes with the probability `crossover`. A
// trial replaces its own member if its cost is lower.
//
// Trials are judged in batches, and each batch builds on the results of the batch before. With a
// batch of one, every trial builds on the one before it.
//
// Errors: no exceptions. Allocates only what the caller's members and judge do; the same seed gives
// the same bits.
// Limits: it never stops early, and it can miss a valley that is narrower than the spread of its
// members.
//
// Source: Storn and Price, J. Global Optimization 11 (1997) 341-359.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace loopwarden::numeric {

struct EvolutionSettings {
  enum class From : std::uint8_t { own, any };  // in the trials that don't use the best member
  From from = From::any;
  std::size_t trials = 1000;  // a multiple of the batch; the first members are not counted
  double crossover = 0.9;
  double least_reach = 0.4;
  double most_reach = 0.9;
};

// The members, their costs, and room for a batch of trials. The number of members is a multiple of
// the batch. A member is any type with size() and elements of type double.
template <class Member>
struct Population {
  std::span<Member> members;
  std::span<double> costs;  // already judged
  std::span<Member> trials;
  std::span<double> trial_costs;
  std::size_t best = 0;  // index of the member that the first trials build on
};

// Returns a random index from 0 to count - 1.
template <class Generator>
std::size_t drawn_below(std::size_t count, Generator& random) noexcept {
  return static_cast<std::size_t>(random.uniform() * static_cast<double>(count));
}

// Changes some places of `trial`, which is a copy of the member that it may replace.
template <class Member, class Generator>
void cross(Member& trial, const Member& from, const Member& a, const Member& b,
           const EvolutionSettings& settings, Generator& random) noexcept {
  const double reach = random.uniform(settings.least_reach, settings.most_reach);
  const std::size_t always = drawn_below(trial.size(), random);
  for (std::size_t j = 0; j < trial.size(); ++j) {
    if (j != always && random.uniform() >= settings.crossover) continue;
    trial[j] = std::clamp(from[j] + reach * (a[j] - b[j]), 0.0, 1.0);
  }
}

// Runs the search and returns the index of the best member. `judge(trials, costs)` fills the costs
// of a batch; `random` is a generator of random.hpp.
template <class Member, class Generator, class Judge>
std::size_t evolve(const Population<Member>& p, const EvolutionSettings& settings,
                   Generator& random, Judge&& judge) {
  std::size_t best = p.best;
  const auto any = [&]() -> const Member& {
    return p.members[drawn_below(p.members.size(), random)];
  };
  std::size_t next = 0;
  for (std::size_t spent = 0; spent < settings.trials; spent += p.trials.size()) {
    for (std::size_t i = 0; i < p.trials.size(); ++i) {
      const Member& own = p.members[next + i];
      const Member& a = any();
      const Member& b = any();
      const bool from_best = random.uniform() < 0.5;
      const Member& other = settings.from == EvolutionSettings::From::own ? own : any();
      p.trials[i] = own;
      cross(p.trials[i], from_best ? p.members[best] : other, a, b, settings, random);
    }
    judge(p.trials, p.trial_costs);
    for (std::size_t i = 0; i < p.trials.size(); ++i) {
      const std::size_t at = next + i;
      if (!(p.trial_costs[i] < p.costs[at])) continue;
      std::swap(p.members[at], p.trials[i]);
      p.costs[at] = p.trial_costs[i];
      if (p.costs[at] < p.costs[best]) best = at;
    }
    next = (next + p.trials.size()) % p.members.size();
  }
  return best;
}

}  // namespace loopwarden::numeric
