// SPDX-License-Identifier: Apache-2.0
// Differential evolution: the least value of a function that jumps and has many valleys.
//
//   trial = own, but in some places  from + reach (a - b),   cut to 0 ... 1
//
// own: the member that the trial is to replace; from: half the time the best member, else own or any
// (settings); a, b: any members. One place, drawn, is always changed, every other with the chance
// `crossover`; reach is drawn anew for each trial. A trial better than its own member takes its place.
//
// Trials are judged a batch at a time: what one batch finds, the next one builds on. With a batch of one
// every trial builds on the one before it.
//
//   places of a member  0 to 1, where the caller puts its ranges     reach  0.4 to 0.9 is usual
//
// Errors: none. Allocates only what the caller's members and judge do; the same seed gives the same bits.
// What it can't do: stop early; find a valley narrower than what its members' spread ever meets.
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
  enum class From : std::uint8_t { own, any };  // where not from the best
  From from = From::any;
  std::size_t trials = 1000;  // a multiple of the batch; the first members are not counted
  double crossover = 0.9;
  double least_reach = 0.4;
  double most_reach = 0.9;
};

// Members, their costs, and room for a batch of trials. The number of members is a multiple of the
// batch. A member is anything with size() and places of type double.
template <class Member>
struct Population {
  std::span<Member> members;
  std::span<double> costs;  // already judged
  std::span<Member> trials;
  std::span<double> trial_costs;
  std::size_t best = 0;  // which member the first trials build on
};

template <class Generator>
std::size_t drawn_below(std::size_t count, Generator& random) noexcept {
  return static_cast<std::size_t>(random.uniform() * static_cast<double>(count));
}

// Changes `trial`, a copy of its own member.
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

// `judge(trials, costs)` fills the costs of a batch; `random` is one of random.hpp. Returns the place of the best
// member.
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
