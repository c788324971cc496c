// SPDX-License-Identifier: Apache-2.0
#include "model/gap/search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "model/gap/accept.hpp"
#include "model/gap/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::gap {
namespace {

constexpr std::size_t kPolish = 1280;  // evaluations
constexpr std::size_t kPolishLast = 3840;
constexpr std::size_t kMostLandings = 8;
constexpr std::size_t kLandingSamples = 16000;  // of all together: long records take long
constexpr double kSameLanding = 0.2;            // of what is left; two that are nearer are one
// Of those with one more effect.
constexpr std::size_t kSettled = 16;  // beside another
constexpr std::size_t kPolished = 4;  // where PV jumps with a parameter
constexpr std::size_t kSeeds = 3;     // best names from which pairs are formed
constexpr std::size_t kShifts =
    4;  // best of what shifts PV, beside which a sticking valve is searched for again
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

std::set<std::string> names_of(const Fit& fit) {
  std::set<std::string> names;
  for (const Candidate* term : fit.terms) names.insert(term->name);
  return names;
}

bool better(const Hypothesis& a, const Hypothesis& b) {
  return a.placed != b.placed ? a.placed : a.score > b.score;
}

// Best hypothesis of each set of names, best first.
std::vector<Hypothesis> distinct(std::vector<Hypothesis> list) {
  std::sort(list.begin(), list.end(), better);
  std::vector<Hypothesis> kept;
  std::set<std::set<std::string>> seen;
  for (Hypothesis& h : list) {
    if (seen.insert(names_of(h.fit)).second) kept.push_back(std::move(h));
  }
  return kept;
}

struct Job {
  const Fit* base;
  const Candidate* added;
  const std::vector<double>* hint;
};

class Search {
 public:
  Search(const Fitter& fitter, const std::vector<Candidate>& all, const Scale& scale,
         const SearchOptions& options, const ParallelFor& parallel,
         const std::function<void(double)>& progress)
      : fitter_(fitter),
        all_(all),
        scale_(scale),
        options_(options),
        parallel_(parallel),
        progress_(progress) {}

  SearchResult run() {
    const bool several = options_.several;
    result_.base = fitter_.fit_model();
    result_.base_rmse = fitter_.training_rmse(result_.base);
    result_.chosen = hypothesis(result_.base);
    progress_(0.05);
    // All refined: one little load ranks nothing where the record shows no noise, as an archive's
    // lines.
    result_.singles = raced(jobs_beside({result_.chosen}), all_.size());
    result_.tried = result_.singles;
    progress_(several ? 0.3 : 0.9);
    if (!result_.singles.empty() && accepted(result_.singles.front(), result_.chosen)) {
      choose(result_.singles.front());
    }
    if (several && !result_.chosen.fit.terms.empty()) add_further();
    prefer_simpler();
    if (jumps(result_.chosen.fit.terms)) land();
    progress_(1.0);
    return std::move(result_);
  }

 private:
  // What a fit is worth, whether or not it tells its effect from a simpler one: while it is rough
  // it may not yet.
  double promise(const Fit& fit) const {
    return (result_.base.deviance - fit.deviance) / 2.0 - penalty(fit);
  }

  Hypothesis hypothesis(Fit fit) const {
    const double score =
        fitter_.tells(fit) ? promise(fit) : -std::numeric_limits<double>::infinity();
    const double rmse = fitter_.training_rmse(fit);
    const bool placed = fitter_.shows_places(fit);
    return Hypothesis{std::move(fit), score, rmse, placed};
  }

  // The candidate as it was found without any other; null before that.
  const Hypothesis* alone(const Candidate& candidate) const {
    const auto found =
        std::find_if(result_.singles.begin(), result_.singles.end(),
                     [&](const Hypothesis& h) { return h.fit.terms[0] == &candidate; });
    return found != result_.singles.end() ? &*found : nullptr;
  }

  Job job(const Fit& base, const Candidate& added) const {
    // What each kind of sticking valve looked like alone.
    const Hypothesis* own = added.slips ? alone(added) : nullptr;
    if (own != nullptr) return {&base, &added, &own->fit.point.searched[0]};
    return {&base, &added, added.slips && !options_.sticks.empty() ? &options_.sticks : nullptr};
  }

  // Best names of what shifts PV as a whole, as they were found without any other.
  std::vector<const Hypothesis*> shifts() const {
    std::vector<const Hypothesis*> best;
    for (const Hypothesis& single : result_.singles) {
      if (single.fit.terms[0]->shifts_pv && best.size() < kShifts) best.push_back(&single);
    }
    return best;
  }

  // Every candidate beside every base, as far as a valve can have both.
  std::vector<Job> jobs_beside(const std::vector<Hypothesis>& bases) const {
    std::vector<Job> jobs;
    for (const Hypothesis& base : bases) {
      const Terms& terms = base.fit.terms;
      const bool friction = std::any_of(terms.begin(), terms.end(),
                                        [](const Candidate* term) { return term->friction; });
      for (const Candidate& candidate : all_) {
        if (contains(base.fit, candidate.name) || (candidate.friction && friction)) continue;
        jobs.push_back(job(base.fit, candidate));
      }
      // A sticking valve is searched for again beside what shifts PV as a whole: without that its
      // own search went astray.
      if (terms.size() != 1 || terms[0]->smooth || terms[0]->block != effects::Block::valve)
        continue;
      for (const Hypothesis* shift : shifts()) {
        if (!contains(base.fit, shift->fit.terms[0]->name))
          jobs.push_back(job(shift->fit, *terms[0]));
      }
    }
    return jobs;
  }

  // Only the `most` that promise most are taken further.
  std::vector<Hypothesis> settled(const std::vector<Job>& jobs, std::size_t most) const {
    std::vector<Hypothesis> made(jobs.size());
    std::vector<std::vector<Fit>> starts(jobs.size());
    parallel_(jobs.size(), [&](std::size_t i) {
      starts[i] = fitter_.approach(*jobs[i].base, *jobs[i].added, jobs[i].hint);
      made[i] = hypothesis(starts[i].front());
    });
    std::vector<std::size_t> order(jobs.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return promise(made[a].fit) > promise(made[b].fit);
    });
    parallel_(std::min(most, jobs.size()), [&](std::size_t i) {
      made[order[i]] = hypothesis(fitter_.settle(starts[order[i]]));
    });
    return made;
  }

  // Best of each set of names, best first.
  std::vector<Hypothesis> raced(const std::vector<Job>& jobs, std::size_t refined) const {
    std::vector<Hypothesis> made = distinct(settled(jobs, refined));
    std::vector<Hypothesis*> rough;
    for (Hypothesis& h : made) {
      if (jumps(h.fit.terms)) rough.push_back(&h);
    }
    std::stable_sort(rough.begin(), rough.end(), [&](const Hypothesis* a, const Hypothesis* b) {
      return promise(a->fit) > promise(b->fit);
    });
    rough.resize(std::min(rough.size(), kPolished));
    parallel_(rough.size(), [&](std::size_t i) {
      *rough[i] = polished(*rough[i], {kPolish, 1, false});
    });
    std::sort(made.begin(), made.end(), better);
    return made;
  }

  // Of two fits of the same names the likelier; where the record does not tell which that is, and
  // rounding would decide, the one that PV follows more closely in free run.
  Hypothesis firmer(Hypothesis a, Hypothesis b) const {
    if (better(b, a)) std::swap(a, b);
    const bool tells = a.placed != b.placed || !std::isfinite(b.score) ||
                       b.training_rmse >= a.training_rmse ||
                       lead_on_blocks_left_out(fitter_, a.fit, b.fit).t > kLeastT;
    return tells ? a : b;
  }

  Hypothesis polished(const Hypothesis& rough, const Fitter::Evolution& how) const {
    Fit close;
    Hypothesis best = hypothesis(fitter_.polish(rough.fit, how, &close));
    return close.terms.empty() ? best : firmer(std::move(best), hypothesis(std::move(close)));
  }

  // A slip more or less changes all, so each evolution lands elsewhere, and rounding decides where.
  void land() {
    const std::size_t landings =
        std::clamp<std::size_t>(kLandingSamples / result_.chosen.fit.samples, 2, kMostLandings);
    std::vector<Hypothesis> landed(landings, result_.chosen);
    parallel_(landings - 1, [&](std::size_t i) {
      landed[i] = polished(result_.chosen, {kPolishLast, i + 1, i > 0});
    });
    std::sort(landed.begin(), landed.end(), better);
    std::vector<std::vector<double>> pv;
    for (const Hypothesis& h : landed) {
      const bool told = h.placed != landed.front().placed || !std::isfinite(h.score) ||
                        lead_on_blocks_left_out(fitter_, landed.front().fit, h.fit).t > kLeastT;
      if (told) continue;
      std::vector<double> own = fitter_.simulate(h.fit);
      const bool again = std::any_of(pv.begin(), pv.end(), [&](const std::vector<double>& other) {
        return numeric::rms_apart(own, other) < kSameLanding * h.training_rmse;
      });
      if (again) continue;
      pv.push_back(std::move(own));
      result_.alike.push_back(h);
    }
    if (!result_.alike.empty()) result_.chosen = result_.alike.front();
  }

  bool accepted(const Hypothesis& more, const Hypothesis& less) const {
    if (!more.placed) return false;
    const bool first = less.fit.terms.empty();
    const bool at_one_moment = more.fit.terms.back()->at_one_moment;
    const Lead lead =
        first || at_one_moment ? Lead{} : lead_on_blocks_left_out(fitter_, more.fit, less.fit);
    const std::vector<double> with = fitter_.simulate(more.fit);
    return worth_adding(
        {.score_with = more.score,
         .score_without = less.score,
         .first = first,
         .at_one_moment = at_one_moment,
         .moves_pv = numeric::rms_apart(std::span(with).first(fitter_.training_end()),
                                        fitter_.simulate(less.fit)),
         .least_rms = scale_.least_rms,
         .left_out_nats = lead.nats,
         .block_t = lead.t,
         .rmse_with = more.training_rmse,
         .rmse_without = less.training_rmse,
         .rmse_model = result_.base_rmse,
         .noise_rms = scale_.noise_rms});
  }

  void choose(const Hypothesis& next) {
    result_.chosen = next;
    result_.path.push_back(names_in_order(next.fit));
  }

  void add_further() {
    std::vector<Hypothesis> seeds(result_.singles.begin(),
                                  result_.singles.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                kSeeds, result_.singles.size())));
    for (std::size_t count = 2; count <= kMostEffects; ++count) {
      if (!leaves_more(result_.chosen.training_rmse, scale_)) return;
      const std::vector<Hypothesis> more = raced(jobs_beside(seeds), kSettled);
      progress_(count == 2 ? 0.75 : 0.95);
      result_.tried.insert(result_.tried.end(), more.begin(), more.end());
      if (more.empty() || !accepted(more.front(), result_.chosen)) return;
      const Hypothesis next = stepped_back(more.front());
      if (next.fit.terms.size() < count) {
        if (next.placed && replaces(effect_set_of(next), effect_set_of(result_.chosen),
                                    result_.base_rmse, scale_.noise_rms)) {
          choose(next);
        }
        return;
      }
      choose(next);
      seeds = {next};
    }
  }

  // An effect that the others have made superfluous goes, and so does the last one if without it
  // the others, fitted from here, do as well.
  Hypothesis stepped_back(Hypothesis next) {
    for (std::size_t i = 0; i < next.fit.terms.size();) {
      Hypothesis without = hypothesis(fitter_.fit_without(next.fit, i, 150));
      for (const Hypothesis& h : result_.tried) {
        if (names_of(h.fit) == names_of(without.fit) && better(h, without)) without = h;
      }
      result_.tried.push_back(without);
      if (superfluous(next.score, without.score) ||
          !closes_a_part(next.training_rmse, without.training_rmse, result_.base_rmse,
                         scale_.noise_rms)) {
        next = std::move(without);
      } else {
        ++i;
      }
    }
    return next;
  }

  // Where the record can't tell them apart, the simpler one.
  void prefer_simpler() {
    for (const Hypothesis& h : result_.tried) {
      if (h.placed && h.fit.terms.size() == result_.chosen.fit.terms.size() &&
          result_.chosen.score - h.score < kTooClose && is_simpler(h.fit, result_.chosen.fit)) {
        result_.chosen = h;
        result_.path.back() = names_in_order(h.fit);
      }
    }
  }

  const Fitter& fitter_;
  const std::vector<Candidate>& all_;
  const Scale& scale_;
  const SearchOptions& options_;
  const ParallelFor& parallel_;
  const std::function<void(double)>& progress_;
  SearchResult result_;
};

}  // namespace

Lead lead_on_blocks_left_out(const Fitter& fitter, const Fit& more, const Fit& less) {
  return lead_between(fitter.left_out_innovations(more, kGainBlocks),
                      fitter.left_out_innovations(less, kGainBlocks),
                      less.deviance - more.deviance);
}

Lead lead_between(const std::vector<double>& a, const std::vector<double>& b,
                  double deviance_less) {
  const std::size_t n = a.size();
  const double constant = deviance_less / (2.0 * static_cast<double>(n));
  std::vector<double> gains;
  for (std::size_t block = 0; block < kGainBlocks; ++block) {
    double gain = 0.0;
    const std::size_t end = (block + 1) * n / kGainBlocks;
    for (std::size_t i = block * n / kGainBlocks; i < end; ++i) {
      gain += constant + 0.5 * (b[i] * b[i] - a[i] * a[i]);
    }
    gains.push_back(gain);
  }
  const double mean = numeric::mean(gains);
  double spread = 0.0;
  for (const double g : gains) spread += (g - mean) * (g - mean);
  spread = std::sqrt(spread / (kGainBlocks - 1));
  const auto ahead = std::count_if(gains.begin(), gains.end(), [](double g) { return g > 0.0; });
  return {mean * kGainBlocks,
          spread > 0.0 ? mean / (spread / std::sqrt(static_cast<double>(kGainBlocks))) : 0.0,
          static_cast<double>(ahead) / kGainBlocks};
}

bool contains(const Fit& fit, std::string_view name) {
  return std::any_of(fit.terms.begin(), fit.terms.end(),
                     [&](const Candidate* term) { return name == term->name; });
}

std::vector<std::string> names_in_order(const Fit& fit) {
  std::vector<std::string> names;
  for (const Candidate* term : fit.terms) names.emplace_back(term->name);
  return names;
}

EffectSet effect_set_of(const Hypothesis& hypothesis) {
  return {names_in_order(hypothesis.fit), hypothesis.score, hypothesis.training_rmse,
          hypothesis.placed};
}

SearchResult search_effects(const Fitter& fitter, const std::vector<Candidate>& all,
                            const Scale& scale, const SearchOptions& options,
                            const ParallelFor& parallel,
                            const std::function<void(double)>& progress) {
  return Search(fitter, all, scale, options, parallel, progress).run();
}

}  // namespace loopwarden::gap
