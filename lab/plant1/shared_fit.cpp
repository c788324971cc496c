// SPDX-License-Identifier: Apache-2.0
#include "lab/plant1/shared_fit.hpp"

#include <algorithm>
#include <mutex>

#include "model/numeric/random.hpp"
#include "base/parallel.hpp"

namespace loopwarden::lab {
namespace {

using numeric::Random;

constexpr double kShareOwnOnly = 0.2;   // share of trials that do not change the shared parameters
constexpr std::size_t kFirstTries = 5;  // own parameters tried for each member at the start

std::size_t pick(Random& random, std::size_t count) {
  return std::min(static_cast<std::size_t>(random.uniform() * static_cast<double>(count)),
                  count - 1);
}

std::vector<double> anywhere(const std::vector<FitBound>& bounds, Random& random) {
  std::vector<double> point;
  for (const FitBound& b : bounds) point.push_back(random.uniform(b.low, b.high));
  return point;
}

// Rule for a trial, the same for the shared and for all own parameters.
struct Recipe {
  enum class Kind { rand, current_to_best, best } kind;
  double weight;
  double crossover;
};

Recipe any_recipe(Random& random) {
  constexpr Recipe::Kind kKinds[] = {Recipe::Kind::rand, Recipe::Kind::current_to_best,
                                     Recipe::Kind::best};
  Recipe recipe{};
  recipe.kind = kKinds[pick(random, 3)];
  recipe.weight = random.uniform(0.4, 0.9);
  recipe.crossover = random.uniform() < 0.5 ? 0.9 : 0.4;
  return recipe;
}

struct Parents {
  const std::vector<double>&self, &a, &b, &c, &best;
};

std::vector<double> mutated(const std::vector<FitBound>& bounds, const Parents& p,
                            const Recipe& recipe, Random& random) {
  std::vector<double> trial = p.self;
  if (bounds.empty()) return trial;
  const std::size_t always = pick(random, bounds.size());
  for (std::size_t j = 0; j < bounds.size(); ++j) {
    if (j != always && random.uniform() >= recipe.crossover) continue;
    const double difference = recipe.weight * (p.b[j] - p.c[j]);
    double value = 0.0;
    switch (recipe.kind) {
      case Recipe::Kind::rand: value = p.a[j] + difference; break;
      case Recipe::Kind::best: value = p.best[j] + difference; break;
      case Recipe::Kind::current_to_best:
        value = p.self[j] + recipe.weight * (p.best[j] - p.self[j]) + difference;
        break;
    }
    // A value outside its bounds is drawn between the parent and the bound.
    if (value < bounds[j].low) value = random.uniform(bounds[j].low, p.self[j]);
    if (value > bounds[j].high) value = random.uniform(p.self[j], bounds[j].high);
    trial[j] = value;
  }
  return trial;
}

SharedFit first_member(const SharedFitProblem& problem, Random& random) {
  SharedFit member;
  member.shared = anywhere(problem.shared, random);
  for (std::size_t r = 0; r < problem.own.size(); ++r) {
    std::vector<double> best;
    double best_cost = 0.0;
    for (std::size_t i = 0; i < kFirstTries; ++i) {
      std::vector<double> own = anywhere(problem.own[r], random);
      const double cost = problem.cost(r, member.shared, own);
      if (i == 0 || cost < best_cost) {
        best_cost = cost;
        best = std::move(own);
      }
    }
    member.own.push_back(std::move(best));
    member.cost.push_back(best_cost);
    member.total += best_cost;
  }
  return member;
}

SharedFit trial_against(const SharedFitProblem& problem, const std::vector<SharedFit>& population,
                        std::size_t index, std::size_t best, Random& random) {
  const SharedFit& self = population[index];
  const SharedFit& a = population[pick(random, population.size())];
  const SharedFit& b = population[pick(random, population.size())];
  const SharedFit& c = population[pick(random, population.size())];
  const Recipe recipe = any_recipe(random);
  const bool own_only = problem.shared.empty() || random.uniform() < kShareOwnOnly;

  SharedFit trial;
  trial.shared = own_only
                     ? self.shared
                     : mutated(problem.shared,
                               {self.shared, a.shared, b.shared, c.shared, population[best].shared},
                               recipe, random);
  for (std::size_t r = 0; r < problem.own.size(); ++r) {
    std::vector<double> other = mutated(
        problem.own[r], {self.own[r], a.own[r], b.own[r], c.own[r], population[best].own[r]},
        recipe, random);
    const double kept = own_only ? self.cost[r] : problem.cost(r, trial.shared, self.own[r]);
    const double moved = problem.cost(r, trial.shared, other);
    trial.own.push_back(moved < kept ? std::move(other) : self.own[r]);
    trial.cost.push_back(std::min(kept, moved));
    trial.total += trial.cost.back();
    if (trial.total > self.total) return self;  // already worse
  }
  return trial;
}

std::size_t best_of(const std::vector<SharedFit>& population) {
  const auto least = [](const SharedFit& a, const SharedFit& b) { return a.total < b.total; };
  return static_cast<std::size_t>(std::min_element(population.begin(), population.end(), least) -
                                  population.begin());
}

SharedFit evolve(const SharedFitProblem& problem, const SharedFitWork& work, const SharedFit* start,
                 Random& random, const std::function<void()>& report) {
  std::vector<SharedFit> population(std::max<std::size_t>(work.population, 4));
  for (SharedFit& member : population) member = first_member(problem, random);
  if (start != nullptr) population.front() = *start;
  std::size_t best = best_of(population);
  for (std::size_t g = 0; g < work.generations; ++g) {
    for (std::size_t i = 0; i < population.size(); ++i) {
      population[i] = trial_against(problem, population, i, best, random);
      if (population[i].total < population[best].total) best = i;
    }
    report();
  }
  return population[best];
}

}  // namespace

SharedFit fit_shared(const SharedFitProblem& problem, const SharedFitWork& work,
                     const SharedFit* start) {
  std::mutex mutex;  // guards `done` and the caller's progress
  std::size_t done = 0;
  const auto report = [&] {
    if (!work.progress) return;
    const std::lock_guard lock(mutex);
    work.progress(++done);
  };
  std::vector<SharedFit> winners(std::max<std::size_t>(work.islands, 1));
  base::parallel_for(winners.size(), work.threads, [&](std::size_t island) {
    Random random(work.seed * 0x9e3779b97f4a7c15ULL + island);
    winners[island] = evolve(problem, work, start, random, report);
  });
  return winners[best_of(winners)];
}

}  // namespace loopwarden::lab
