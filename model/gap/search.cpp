// SPDX-License-Identifier: Apache-2.0
#include "model/gap/search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "model/gap/accept.hpp"
#include "model/gap/constants.hpp"

namespace loopwarden::gap {
namespace {

constexpr std::size_t kPolish = 1280;  // evaluations
constexpr std::size_t kPolishLast = 3840;
constexpr std::size_t kSettled = 16;  // of those with one more effect, refined
constexpr std::size_t kPolished = 4;  // of the best with one more effect
constexpr std::size_t kSeeds = 3;     // best names from which pairs are formed
constexpr std::size_t kMostEffects = 3;

double penalty(const Fit& fit) {
  double parameters = 0.0;
  double prior_nats = 0.0;
  for (const Candidate* term : fit.terms) {
    parameters += term->parameters + (term->starts_offset() ? 1 : 0);
    prior_nats += term->prior_nats;
  }
  return 0.5 * parameters * std::log(static_cast<double>(fit.samples)) + prior_nats;
}

// Fewer fitted numbers, then the commoner.
bool is_simpler(const Fit& a, const Fit& b) {
  const auto cost = [](const Fit& fit) {
    std::pair<int, double> sum{0, 0.0};
    for (const Candidate* term : fit.terms) {
      sum.first += term->parameters;
      sum.second += term->prior_nats;
    }
    return sum;
  };
  return cost(a) < cost(b);
}

std::vector<std::string> names_in_order(const Fit& fit) {
  std::vector<std::string> names;
  for (const Candidate* term : fit.terms) names.emplace_back(term->name);
  return names;
}

std::set<std::string> names_of(const Fit& fit) {
  std::set<std::string> names;
  for (const Candidate* term : fit.terms) names.insert(term->name);
  return names;
}

// Student's t of the gain in log likelihood over blocks of the record.
double block_t(const Fitter& fitter, const Fit& more, const Fit& less) {
  const std::vector<double> a = fitter.innovations(more);
  const std::vector<double> b = fitter.innovations(less);
  const std::size_t n = a.size();
  const double constant = (less.deviance - more.deviance) / (2.0 * static_cast<double>(n));
  std::vector<double> gains;
  for (std::size_t block = 0; block < kGainBlocks; ++block) {
    double gain = 0.0;
    const std::size_t end = (block + 1) * n / kGainBlocks;
    for (std::size_t i = block * n / kGainBlocks; i < end; ++i) {
      gain += constant + 0.5 * (b[i] * b[i] - a[i] * a[i]);
    }
    gains.push_back(gain);
  }
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / kGainBlocks;
  double spread = 0.0;
  for (const double g : gains) spread += (g - mean) * (g - mean);
  spread = std::sqrt(spread / (kGainBlocks - 1));
  return spread > 0.0 ? mean / (spread / std::sqrt(static_cast<double>(kGainBlocks))) : 0.0;
}

struct Job {
  const Fit* base;
  const Candidate* added;
  const std::vector<double>* hint;
};

double rms_apart(const std::vector<double>& a, const std::vector<double>& b, std::size_t end) {
  double sum = 0.0;
  for (std::size_t k = 0; k < end; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(end));
}

}  // namespace

bool contains(const Fit& fit, std::string_view name) {
  return std::any_of(fit.terms.begin(), fit.terms.end(),
                     [&](const Candidate* term) { return name == term->name; });
}

SearchResult search_effects(const Fitter& fitter, const std::vector<Candidate>& all,
                            const Scale& scale, const SearchOptions& options,
                            const ParallelFor& parallel,
                            const std::function<void(double)>& progress) {
  SearchResult result;
  result.base = fitter.fit_model();
  const std::size_t end = fitter.training_end();
  result.base_rmse = fitter.training_rmse(result.base);
  const auto hypothesis = [&](Fit fit) {
    const double score = fitter.tells(fit)
                             ? (result.base.deviance - fit.deviance) / 2.0 - penalty(fit)
                             : -std::numeric_limits<double>::infinity();
    const double rmse = fitter.training_rmse(fit);
    return Hypothesis{std::move(fit), score, rmse};
  };
  const auto better = [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; };
  result.chosen = hypothesis(result.base);
  progress(0.05);

  const auto static_alone = [&](const Candidate& candidate) -> const Hypothesis* {
    if (!candidate.shifts_pv) return nullptr;
    for (const Hypothesis& h : result.singles) {
      if (h.fit.terms[0] == &candidate) return &h;
    }
    return nullptr;
  };
  const auto add_each = [&](const std::vector<Hypothesis>& bases, bool polished) {
    std::vector<Job> jobs;
    // What each kind of sticking valve looked like alone.
    const auto hint_for = [&](const Candidate& candidate) -> const std::vector<double>* {
      if (!candidate.slips) return nullptr;
      for (const Hypothesis& h : result.singles) {
        if (h.fit.terms[0] == &candidate) return &h.fit.point.searched[0];
      }
      return nullptr;
    };
    for (const Hypothesis& base : bases) {
      for (const Candidate& candidate : all) {
        if (contains(base.fit, candidate.name)) continue;
        if (candidate.friction &&
            std::any_of(base.fit.terms.begin(), base.fit.terms.end(),
                        [](const Candidate* term) { return term->friction; })) {
          continue;
        }
        // A sticking valve is searched for again beside what shifts PV as a whole: without that its
        // own search went astray.
        const Candidate* first = base.fit.terms.size() == 1 ? base.fit.terms[0] : nullptr;
        const Hypothesis* alone =
            first != nullptr && !first->smooth && first->block == plant::Block::valve
                ? static_alone(candidate)
                : nullptr;
        if (alone != nullptr) {
          jobs.push_back({&alone->fit, first, hint_for(*first)});
        }
        jobs.push_back({&base.fit, &candidate, hint_for(candidate)});
      }
    }
    std::vector<Hypothesis> made(jobs.size());
    if (polished) {
      parallel(jobs.size(), [&](std::size_t i) {
        const Fit fit = fitter.fit_added(*jobs[i].base, *jobs[i].added, jobs[i].hint);
        made[i] = hypothesis(fitter.polish(fit, kPolish));
      });
      return made;
    }
    // Only those that promise most are taken all the way.
    std::vector<std::vector<Fit>> starts(jobs.size());
    parallel(jobs.size(), [&](std::size_t i) {
      starts[i] = fitter.approach(*jobs[i].base, *jobs[i].added, jobs[i].hint);
      made[i] = hypothesis(starts[i].front());
    });
    std::vector<std::size_t> order(jobs.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return better(made[a], made[b]); });
    const std::size_t settled = std::min(kSettled, jobs.size());
    parallel(settled,
             [&](std::size_t i) { made[order[i]] = hypothesis(fitter.settle(starts[order[i]])); });
    return made;
  };
  // Best hypothesis of each set of names, best first.
  const auto distinct = [&](std::vector<Hypothesis> list) {
    std::sort(list.begin(), list.end(), better);
    std::vector<Hypothesis> kept;
    std::set<std::set<std::string>> seen;
    for (Hypothesis& h : list) {
      if (seen.insert(names_of(h.fit)).second) kept.push_back(std::move(h));
    }
    return kept;
  };
  const auto accepted = [&](const Hypothesis& more, const Hypothesis& less) {
    const bool first = less.fit.terms.empty();
    return worth_adding(
        {.score_with = more.score,
         .score_without = less.score,
         .first = first,
         .at_one_moment = more.fit.terms.back()->at_one_moment,
         .moves_pv = rms_apart(fitter.simulate(more.fit), fitter.simulate(less.fit), end),
         .least_rms = scale.least_rms,
         .block_t = first ? 0.0 : block_t(fitter, more.fit, less.fit),
         .rmse_with = more.training_rmse,
         .rmse_without = less.training_rmse});
  };

  result.singles = distinct(add_each({result.chosen}, true));
  result.tried = result.singles;
  progress(options.several ? 0.3 : 0.9);
  if (!result.singles.empty() && accepted(result.singles.front(), result.chosen)) {
    result.chosen = result.singles.front();
    result.path.push_back(names_in_order(result.chosen.fit));
  }
  if (options.several && !result.chosen.fit.terms.empty() &&
      leaves_more(result.chosen.training_rmse, scale)) {
    std::vector<Hypothesis> seeds(result.singles.begin(),
                                  result.singles.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                               kSeeds, result.singles.size())));
    for (std::size_t count = 2; count <= kMostEffects; ++count) {
      std::vector<Hypothesis> more = distinct(add_each(seeds, false));
      const std::size_t close = std::min(kPolished, more.size());
      parallel(close,
               [&](std::size_t i) { more[i] = hypothesis(fitter.polish(more[i].fit, kPolish)); });
      std::sort(more.begin(), more.end(), better);
      progress(count == 2 ? 0.75 : 0.95);
      result.tried.insert(result.tried.end(), more.begin(), more.end());
      if (more.empty() || !accepted(more.front(), result.chosen)) break;
      // Step back: an effect that the others have made superfluous goes, and so does the last one if
      // without it the others, fitted from here, do as well.
      Hypothesis next = more.front();
      for (std::size_t i = 0; i < next.fit.terms.size();) {
        Hypothesis without = hypothesis(fitter.fit_without(next.fit, i, 150));
        for (const Hypothesis& h : result.tried) {
          if (names_of(h.fit) == names_of(without.fit) && better(h, without)) without = h;
        }
        result.tried.push_back(without);
        if (superfluous(next.score, without.score)) {
          next = std::move(without);
        } else {
          ++i;
        }
      }
      if (next.fit.terms.size() < count) {
        if (better(next, result.chosen)) result.chosen = std::move(next);
        break;
      }
      result.chosen = std::move(next);
      result.path.push_back(names_in_order(result.chosen.fit));
      if (!leaves_more(result.chosen.training_rmse, scale)) break;
      seeds = {result.chosen};
    }
  }
  // Where the record can't tell them apart, the simpler one.
  for (const Hypothesis& h : result.tried) {
    if (h.fit.terms.size() == result.chosen.fit.terms.size() &&
        result.chosen.score - h.score < kTooClose && is_simpler(h.fit, result.chosen.fit)) {
      result.chosen = h;
      result.path.back() = names_in_order(h.fit);
    }
  }
  Hypothesis polished = hypothesis(fitter.polish(result.chosen.fit, kPolishLast));
  if (better(polished, result.chosen)) result.chosen = std::move(polished);
  progress(1.0);
  return result;
}

}  // namespace loopwarden::gap
