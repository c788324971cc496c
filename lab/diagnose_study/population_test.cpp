// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/population_test.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"
#include "lab/diagnose_study/boosted_trees.hpp"
#include "lab/diagnose_study/diagnosis_fit.hpp"

namespace loopwarden::lab {
namespace {

constexpr std::size_t kPermutations = 999;
constexpr double kIntervalShare = 0.9;
constexpr std::size_t kMostForEnergy = 800;  // number of simulated loops
constexpr double kLeastWeightOfRows = 0.01;  // of a leaf, in p (1 - p) of all rows
constexpr std::size_t kFoldsOfSimulated =
    2;  // trees that score simulated loops were not trained on them

using Stratum = std::pair<std::string, bool>;  // kind and label
Stratum stratum_of(const Evidence& e) { return {e.kind, e.sticky}; }

// A simulated loop, or the windows of a measured one.
struct ComparedLoop {
  std::vector<std::size_t> rows;
  Stratum stratum;
  std::string plant;
  std::size_t fold = 0;  // of a simulated loop
  bool measured() const { return !plant.empty(); }
};

struct Compared {
  std::vector<std::vector<double>> rows;
  std::vector<ComparedLoop> loops;
};

std::vector<ComparedLoop> loops_of(const std::vector<Evidence>& windows, std::size_t first_row) {
  std::map<std::string, std::size_t> place;
  std::vector<ComparedLoop> loops;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const Evidence& w = windows[i];
    const std::string loop = w.plant.empty() ? std::to_string(i) : w.plant + "/" + w.loop;
    const auto [at, added] = place.try_emplace(loop, loops.size());
    if (added) loops.push_back({.rows = {}, .stratum = stratum_of(w), .plant = w.plant});
    loops[at->second].rows.push_back(first_row + i);
  }
  return loops;
}

Compared comparable(const std::vector<Evidence>& simulated, const std::vector<Evidence>& measured) {
  Compared c;
  for (const auto* windows : {&simulated, &measured}) {
    const std::vector<ComparedLoop> loops = loops_of(*windows, c.rows.size());
    c.loops.insert(c.loops.end(), loops.begin(), loops.end());
    for (const Evidence& e : *windows) c.rows.push_back(e.numbers);
  }
  std::map<Stratum, std::set<bool>> seen;
  for (const ComparedLoop& loop : c.loops) seen[loop.stratum].insert(loop.measured());
  std::erase_if(c.loops, [&](const ComparedLoop& loop) { return seen[loop.stratum].size() < 2; });
  std::map<Stratum, std::size_t> simulated_of;
  for (ComparedLoop& loop : c.loops) {
    if (!loop.measured()) loop.fold = simulated_of[loop.stratum]++ % kFoldsOfSimulated;
  }
  return c;
}

// Returns the weight of each loop: 1 for a measured one. The simulated loops of a stratum have the
// same total weight as its measured ones. `counts`: loops with a weight above 0.
template <typename Counts>
std::vector<double> weights_of(const std::vector<ComparedLoop>& loops, Counts&& counts) {
  std::map<Stratum, std::pair<double, double>> number;  // measured, simulated
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (!counts(i)) continue;
    auto& [measured, simulated] = number[loops[i].stratum];
    (loops[i].measured() ? measured : simulated) += 1.0;
  }
  std::vector<double> weights(loops.size(), 0.0);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (!counts(i)) continue;
    const auto [measured, simulated] = number[loops[i].stratum];
    weights[i] = loops[i].measured() ? 1.0 : measured / simulated;
  }
  return weights;
}

struct Scored {
  std::string plant;
  double auc = 0.5;
};

// Scores the measured loops that are left out, with trees trained on the other ones.
std::vector<Scored> judge(const Compared& c, const std::function<bool(const ComparedLoop&)>& out) {
  std::vector<Scored> scored;
  std::vector<double> shares(c.loops.size(), 0.0);
  for (std::size_t fold = 0; fold < kFoldsOfSimulated; ++fold) {
    const auto trained = [&](std::size_t i) {
      const ComparedLoop& loop = c.loops[i];
      return loop.measured() ? !out(loop) : loop.fold != fold;
    };
    const std::vector<double> of_loops = weights_of(c.loops, trained);
    std::vector<double> weights(c.rows.size(), 0.0);
    std::vector<char> positive(c.rows.size(), 0);
    for (std::size_t i = 0; i < c.loops.size(); ++i) {
      for (const std::size_t row : c.loops[i].rows) {
        weights[row] = of_loops[i] / static_cast<double>(c.loops[i].rows.size());
        positive[row] = c.loops[i].measured() ? 1 : 0;
      }
    }
    TrainingSettings settings;
    settings.least_weight = kLeastWeightOfRows * static_cast<double>(c.rows.size());
    const std::vector<double> logits = boosted_logits(c.rows, positive, weights, settings);
    for (std::size_t i = 0; i < c.loops.size(); ++i) {
      const ComparedLoop& loop = c.loops[i];
      if (!loop.measured() || !out(loop)) continue;
      double lower = 0.0;
      double pairs = 0.0;
      for (std::size_t k = 0; k < c.loops.size(); ++k) {
        if (c.loops[k].measured() || trained(k) || c.loops[k].stratum != loop.stratum) continue;
        const double simulated = logits[c.loops[k].rows.front()];
        for (const std::size_t row : loop.rows) {
          pairs += 1.0;
          lower += logits[row] > simulated ? 1.0 : logits[row] == simulated ? 0.5 : 0.0;
        }
      }
      shares[i] += (pairs > 0.0 ? lower / pairs : 0.5) / static_cast<double>(kFoldsOfSimulated);
    }
  }
  for (std::size_t i = 0; i < c.loops.size(); ++i) {
    if (c.loops[i].measured() && out(c.loops[i])) scored.push_back({c.loops[i].plant, shares[i]});
  }
  return scored;
}

double mean_auc(const std::vector<Scored>& scored) {
  double sum = 0.0;
  for (const Scored& s : scored) sum += s.auc;
  return sum / static_cast<double>(scored.size());
}

// Uses at most kMostForEnergy simulated loops and all measured ones, with each number divided by
// its deviation.
void find_energy(Compared c, PopulationTest& test) {
  std::vector<ComparedLoop> loops;
  std::size_t simulated = 0;
  for (const ComparedLoop& loop : c.loops) {
    if (loop.measured() || simulated++ < kMostForEnergy) loops.push_back(loop);
  }
  const std::size_t n = loops.size();
  std::vector<double> column(c.rows.size());
  for (std::size_t e = 0; e < c.rows.front().size(); ++e) {
    for (std::size_t i = 0; i < c.rows.size(); ++i) column[i] = c.rows[i][e];
    const double deviation = numeric::deviation(column);
    for (auto& row : c.rows) row[e] = deviation > 0.0 ? row[e] / deviation : 0.0;
  }
  // The distance of a loop from itself is 0, even if its windows differ. Otherwise loops with many
  // windows would appear dissimilar.
  const auto between = [&](const ComparedLoop& a, const ComparedLoop& b) {
    double sum = 0.0;
    for (const std::size_t i : a.rows) {
      for (const std::size_t k : b.rows) {
        double square = 0.0;
        for (std::size_t e = 0; e < c.rows[i].size(); ++e) {
          square += (c.rows[i][e] - c.rows[k][e]) * (c.rows[i][e] - c.rows[k][e]);
        }
        sum += std::sqrt(square);
      }
    }
    return sum / static_cast<double>(a.rows.size() * b.rows.size());
  };
  std::vector<float> distances(n * n, 0.0F);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      distances[a * n + b] = distances[b * n + a] = static_cast<float>(between(loops[a], loops[b]));
    }
  }
  // Sums over all pairs of weights with the signs of the two populations: -E|x - x'| - E|y - y'| +
  // 2 E|x - y|.
  const auto form = [&](const std::vector<double>& left, const std::vector<double>& right) {
    double sum = 0.0;
    for (std::size_t a = 0; a < n; ++a) {
      double row = 0.0;
      for (std::size_t b = 0; b < n; ++b) {
        row += right[b] * static_cast<double>(distances[a * n + b]);
      }
      sum += left[a] * row;
    }
    return sum;
  };
  const std::vector<double> weights = weights_of(loops, [](std::size_t) { return true; });
  const auto measured = static_cast<double>(std::count_if(
      loops.begin(), loops.end(), [](const ComparedLoop& loop) { return loop.measured(); }));
  std::vector<double> of_measured(n, 0.0);
  std::vector<double> of_simulated(n, 0.0);
  std::vector<double> sign(n);
  for (std::size_t i = 0; i < n; ++i) {
    (loops[i].measured() ? of_measured : of_simulated)[i] = weights[i] / measured;
    sign[i] = of_measured[i] - of_simulated[i];
  }
  const double found = -form(sign, sign);
  test.energy = found / (2.0 * form(of_measured, of_simulated));
  std::map<Stratum, std::vector<std::size_t>> members;
  for (std::size_t i = 0; i < n; ++i) members[loops[i].stratum].push_back(i);
  numeric::Random random(1);
  std::size_t as_large = 1;
  for (std::size_t trial = 0; trial < kPermutations; ++trial) {
    for (const auto& [stratum, of_stratum] : members) {
      for (std::size_t i = of_stratum.size(); i-- > 1;) {
        const auto k = static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1));
        std::swap(sign[of_stratum[i]], sign[of_stratum[k]]);
      }
    }
    as_large += -form(sign, sign) >= found ? 1U : 0U;
  }
  test.p = static_cast<double>(as_large) / static_cast<double>(kPermutations + 1);
}

}  // namespace

PopulationTest test_population(const std::vector<Evidence>& simulated,
                               const std::vector<Evidence>& measured,
                               const numeric::ParallelFor& parallel) {
  PopulationTest test;
  const Compared c = comparable(simulated, measured);
  std::set<std::string> names;
  for (const ComparedLoop& loop : c.loops) {
    if (loop.measured()) {
      ++test.loops;
      names.insert(loop.plant);
    } else {
      ++test.simulated;
    }
  }
  if (names.size() < 2) return test;
  const std::vector<std::string> plants(names.begin(), names.end());
  std::vector<std::vector<Scored>> of_plant(plants.size());
  parallel(plants.size(), [&](std::size_t i) {
    of_plant[i] = judge(c, [&](const ComparedLoop& loop) { return loop.plant == plants[i]; });
  });
  std::vector<std::size_t> measured_loops;
  for (std::size_t i = 0; i < c.loops.size(); ++i) {
    if (c.loops[i].measured()) measured_loops.push_back(i);
  }
  std::vector<double> of_loop(measured_loops.size());
  parallel(measured_loops.size(), [&](std::size_t i) {
    const ComparedLoop* left_out = &c.loops[measured_loops[i]];
    of_loop[i] = mean_auc(judge(c, [&](const ComparedLoop& loop) { return &loop == left_out; }));
  });
  test.auc_loops_left_out = numeric::mean(of_loop);
  std::vector<Scored> all;
  for (std::size_t i = 0; i < plants.size(); ++i) {
    test.plants.push_back(
        {.name = plants[i], .loops = of_plant[i].size(), .auc = mean_auc(of_plant[i])});
    all.insert(all.end(), of_plant[i].begin(), of_plant[i].end());
  }
  test.auc = mean_auc(all);
  const BootstrapInterval interval = bootstrap(
      all.size(), 1,
      [&](std::span<const std::size_t> drawn) {
        double sum = 0.0;
        for (const std::size_t i : drawn) sum += all[i].auc;
        return sum / static_cast<double>(drawn.size());
      },
      kIntervalShare);
  test.auc_low = interval.low;
  test.auc_high = interval.high;
  find_energy(c, test);
  return test;
}

}  // namespace loopwarden::lab
