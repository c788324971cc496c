// SPDX-License-Identifier: Apache-2.0
#include "model/numeric/evolution.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/numeric/random.hpp"
#include "tests/support/rt_guard.hpp"

namespace evolution_test {

using namespace loopwarden;
using namespace loopwarden::numeric;

namespace {

using Place = std::array<double, 2>;

constexpr std::size_t kMembers = 64;

// Evaluates `batch` trials at a time; returns the best place and its cost.
struct Run {
  Place best;
  double cost;
};
template <class Cost>
Run run(std::size_t batch, EvolutionSettings settings, std::uint64_t seed, Cost cost) {
  Random random(seed);
  std::array<Place, kMembers> members;
  std::array<double, kMembers> costs;
  std::array<Place, kMembers> trials;
  std::array<double, kMembers> trial_costs;
  for (std::size_t i = 0; i < kMembers; ++i) {
    members[i] = {random.uniform(), random.uniform()};
    costs[i] = cost(members[i]);
  }
  const std::size_t best =
      evolve(Population<Place>{members, costs, std::span(trials).first(batch),
                               std::span(trial_costs).first(batch), 0},
             settings, random, [&](std::span<const Place> at, std::span<double> to) {
               for (std::size_t i = 0; i < at.size(); ++i) to[i] = cost(at[i]);
             });
  return {members[best], costs[best]};
}

// Rastrigin's function on -5.12 to 5.12: about a hundred valleys, the deepest at 0.
double rastrigin(const Place& p) {
  double sum = 20.0;
  for (const double v : p) {
    const double x = 10.24 * v - 5.12;
    sum += x * x - 10.0 * std::cos(2.0 * std::numbers::pi * x);
  }
  return sum;
}

}  // namespace

TEST_CASE("the deepest of many valleys, in batches and one by one", "[numeric]") {
  for (const std::size_t batch : {std::size_t{1}, std::size_t{8}, kMembers}) {
    for (const auto from : {EvolutionSettings::From::own, EvolutionSettings::From::any}) {
      int found = 0;
      for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        if (run(batch, {.from = from, .trials = 12'800}, seed, rastrigin).cost < 1e-6) ++found;
      }
      INFO("batch " << batch);
      CHECK(found >= 18);
    }
  }
}

TEST_CASE("steps without slopes", "[numeric]") {
  const auto stairs = [](const Place& p) {
    return std::floor(40.0 * std::abs(p[0] - 0.7)) + std::floor(40.0 * std::abs(p[1] - 0.2));
  };
  CHECK(run(1, {.trials = 6400}, 5, stairs).cost == 0.0);
}

TEST_CASE("an answer on the bounds is reached, and no place outside is evaluated", "[numeric]") {
  bool outside = false;
  const auto slope = [&](const Place& p) {
    for (const double v : p) outside = outside || v < 0.0 || v > 1.0;
    return p[0] - 2.0 * p[1];
  };
  const Run found = run(8, {.trials = 3200}, 2, slope);
  CHECK(found.best[0] == 0.0);
  CHECK(found.best[1] == 1.0);
  CHECK_FALSE(outside);
}

TEST_CASE("the same seed finds the same place, another seed takes another path", "[numeric]") {
  const EvolutionSettings settings{.trials = 640};
  const Run one = run(8, settings, 3, rastrigin);
  CHECK(run(8, settings, 3, rastrigin).best == one.best);
  CHECK(run(8, settings, 4, rastrigin).best != one.best);
}

TEST_CASE("a place that can't be judged never replaces another", "[numeric]") {
  const auto half = [](const Place& p) { return p[0] < 0.5 ? std::nan("") : 1.0 + p[0] + p[1]; };
  Random random(1);
  std::array<Place, 8> members;
  std::array<double, 8> costs;
  for (std::size_t i = 0; i < members.size(); ++i) {
    members[i] = {random.uniform(0.6, 1.0), random.uniform()};
    costs[i] = half(members[i]);
  }
  std::array<Place, 1> trial;
  std::array<double, 1> trial_cost;
  const std::size_t best =
      evolve(Population<Place>{members, costs, trial, trial_cost, 0}, {.trials = 800}, random,
             [&](std::span<const Place> at, std::span<double> to) { to[0] = half(at[0]); });
  for (const Place& m : members) CHECK(m[0] >= 0.5);
  CHECK(costs[best] == Approx(1.5).epsilon(0.02));
}

TEST_CASE("members of fixed size take no memory", "[numeric]") {
  tests::RealTimeSection::reset();
  Run found{};
  {
    const tests::RealTimeSection section;
    found = run(8, {.trials = 640}, 1, rastrigin);
  }
  CHECK(found.cost < 20.0);
  CHECK(tests::RealTimeSection::offences() == 0);
}

}  // namespace evolution_test
