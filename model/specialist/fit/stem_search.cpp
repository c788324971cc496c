// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/fit/stem_search.hpp"

#include <span>

#include "model/numeric/evolution.hpp"
#include "model/numeric/lanes.hpp"
#include "model/numeric/random.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/hysteresis/hysteresis_width.hpp"
#include "model/effects/low_air_supply/low_air_supply.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/effects/stiction/stiction_he.hpp"

namespace loopwarden::specialist {
namespace {

// Range of the gain during a grid search: the largest error of the assumed gain.
constexpr float kGainLow = 0.88F;
constexpr float kGainHigh = 1.12F;

// Sizes of the grid, % of CO span.
constexpr double kSmallest = 0.8;
constexpr std::array kStarts{0.0, 1.0, -1.0};
constexpr std::array kJumps{0.2, 0.5, 0.9};
// Generations of the evolution of a sticking stem. Twice as many find little more.
constexpr int kGenerations = 50;

using numeric::Lanes;
static_assert(kStems == 2 * numeric::kLanes);

Lanes every(float value) noexcept { return numeric::every<Lanes>(static_cast<double>(value)); }

// For a gradual hysteresis. The plant's has twelve, and a window can't distinguish twelve from
// four.
constexpr std::size_t kPlays = 4;

}  // namespace

template <class Walk>
void WindowFitter::Trial::with_stem(Law law, double u0, double period_s, Walk walk) noexcept {
  const auto static_friction = [](const Trial& x) { return x.size * (1.0 + x.shape) / 2.0; };
  const auto moving_friction = [](const Trial& x) { return x.size * (1.0 - x.shape) / 2.0; };
  const auto stuck_at = [=](const Trial& x) { return u0 + x.start * static_friction(x); };
  switch (law) {
    case Law::none: return;
    case Law::play:
      return walk([=](auto put) {
        return effects::PlayLaw<typename decltype(put)::Number>{
            put([](const Trial& x) { return x.size / 2.0; }),
            put([=](const Trial& x) { return u0 + x.start * x.size / 2.0; })};
      });
    case Law::plays:
      return walk([=](auto put) {
        effects::PlaysLaw<typename decltype(put)::Number, kPlays> stem;
        for (std::size_t i = 0; i < kPlays; ++i) {
          const auto half = [i](const Trial& x) {
            return effects::half_deadbands<kPlays>(x.size, x.shape)[i];
          };
          stem.plays[i] = {put(half), put([=](const Trial& x) { return u0 + x.start * half(x); })};
        }
        return stem;
      });
    case Law::he:
      return walk([=](auto put) {
        return effects::HeLaw<typename decltype(put)::Number>{put(static_friction),
                                                              put(moving_friction), put(stuck_at)};
      });
    case Law::choudhury:
      return walk([=](auto put) {
        return effects::ChoudhuryLaw<typename decltype(put)::Number>{
            put(static_friction), put(moving_friction), put(stuck_at),
            put([=](const Trial&) { return u0; }), put([](const Trial&) { return 0.0; })};
      });
    case Law::low_air:
      return walk([=](auto put) {
        using Stem = effects::LowAirLaw<typename decltype(put)::Number>;
        return Stem({.limit = put([](const Trial& x) { return x.limit; }),
                     .share = put([](const Trial&) { return 1.0; }),
                     .rate = put([](const Trial& x) { return x.shape; }),
                     .lag_s = put([](const Trial& x) { return x.lag_s; })},
                    period_s, put([=](const Trial& x) { return std::min(u0, x.limit) + x.start; }));
      });
  }
}

namespace {

// The numbers of a stem: one candidate's values, or those of as many candidates as there are lanes.
template <class Trial>
struct OneOf {
  using Number = float;
  const Trial& candidate;
  template <class Value>
  float operator()(Value value) const noexcept {
    return static_cast<float>(value(candidate));
  }
};
template <class Trial>
struct RowOf {
  using Number = Lanes;
  const Trial* candidates;
  template <class Value>
  Lanes operator()(Value value) const noexcept {
    Lanes row;
    for (std::size_t i = 0; i < numeric::kLanes; ++i) {
      row[i] = static_cast<float>(value(candidates[i]));
    }
    return row;
  }
};

}  // namespace

// The error of a row of candidates after the best fit of gain and basis.
struct WindowFitter::Projection {
  Lanes first;  // a constant is free: near zero the sums keep their digits
  Lanes square = every(0.0F);
  Lanes with_target = every(0.0F);
  Lanes along[3] = {every(0.0F), every(0.0F), every(0.0F)};

  void add(const WindowFitter& e, std::size_t b, Lanes y) noexcept {
    y = y - first;
    square = square + y * y;
    with_target = with_target + y * every(e.target_lanes_[b]);
    for (std::size_t i = 0; i < 3; ++i) along[i] = along[i] + y * every(e.basis_lanes_[i][b]);
  }
  void judge(const WindowFitter& e, Trial* candidates) const noexcept {
    for (std::size_t i = 0; i < numeric::kLanes; ++i) {
      float own = square[i];
      for (std::size_t k = 0; k < 3; ++k) own -= along[k][i] * along[k][i];
      const float both = with_target[i];
      const float gain =
          std::clamp(own > 1e-4F * square[i] ? both / own : 1.0F, kGainLow, kGainHigh);
      candidates[i].misfit =
          e.target_square_ + static_cast<double>(gain * (gain * own - 2.0F * both));
    }
  }
};

// A row of stems, each followed by the lag.
template <class Stem>
struct WindowFitter::Row {
  Stem stem;
  Lanes state;
  Projection sums;
  Row(const Stem& at_rest, float u0) noexcept
      : stem(at_rest), state(stem.step(every(u0))), sums{.first = state} {}
};

// Evaluates a batch of stems block by block. Each gets the error with its best gain.
template <class Stem>
void WindowFitter::try_blocks(Trial* candidates, const Stem& first,
                              const Stem& second) const noexcept {
  const Lanes keep = every(static_cast<float>(keep_));
  const Lanes take = every(static_cast<float>(1.0 - keep_));
  const Lanes mean_keep = every(static_cast<float>(mean_keep_));
  const Lanes mean_take = every(static_cast<float>(1.0 - mean_keep_));
  Row<Stem> one(first, u_lanes_[0]);
  Row<Stem> two(second, u_lanes_[0]);
  const auto step = [&](Row<Stem>& row, std::size_t b, Lanes u) {
    const Lanes v = row.stem.step(u);
    const Lanes y = mean_keep * row.state + mean_take * v;
    row.state = keep * row.state + take * v;
    row.sums.add(*this, b, y);
  };
  for (std::size_t b = 0; b < blocks_; ++b) {
    const Lanes u = every(u_lanes_[b]);
    step(one, b, u);
    step(two, b, u);
  }
  one.sums.judge(*this, candidates);
  two.sums.judge(*this, candidates + numeric::kLanes);
}

// The same sample by sample, with the fitted process.
template <class Stem>
void WindowFitter::try_samples(Trial* candidates, const Stem& first,
                               const Stem& second) const noexcept {
  const float kept = static_cast<float>(process_.keep);
  const Lanes keep = every(kept);
  const Lanes take = every(1.0F - kept);
  const Lanes share = every(1.0F / static_cast<float>(samples_per_block_));
  Row<Stem> one(first, co_at(0));
  Row<Stem> two(second, co_at(0));
  const auto step = [&](Row<Stem>& row, Lanes& sum, Lanes u) {
    const Lanes v = row.stem.step(u);
    row.state = keep * row.state + take * v;
    sum = sum + row.state;
  };
  std::size_t k = 0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    Lanes sum_one = every(0.0F);
    Lanes sum_two = every(0.0F);
    for (std::size_t i = 0; i < samples_per_block_; ++i, ++k) {
      const Lanes u = every(co_at(k));
      step(one, sum_one, u);
      step(two, sum_two, u);
    }
    one.sums.add(*this, b, sum_one * share);
    two.sums.add(*this, b, sum_two * share);
  }
  one.sums.judge(*this, candidates);
  two.sums.judge(*this, candidates + numeric::kLanes);
}

// Evaluates `candidates`, which are a batch of one law.
void WindowFitter::evaluate(Trial* candidates, Grain grain) const noexcept {
  const auto u0 = static_cast<double>(grain == Grain::block ? u_lanes_[0] : co_at(0));
  const double period_s = grain == Grain::block ? block_s_ : facts_.period_s;
  Trial::with_stem(candidates[0].law, u0, period_s, [&](auto make) {
    const auto first = make(RowOf<Trial>{candidates});
    const auto second = make(RowOf<Trial>{candidates + numeric::kLanes});
    return grain == Grain::block ? try_blocks(candidates, first, second)
                                 : try_samples(candidates, first, second);
  });
}

// Writes the stem of one candidate into v_, sample by sample.
void WindowFitter::trace(const Trial& candidate) noexcept {
  if (candidate.law == Trial::Law::none) {
    for (std::size_t k = 0; k < v_.size(); ++k) v_[k] = static_cast<double>(co_at(k));
    return;
  }
  const auto u0 = static_cast<double>(co_at(0));
  Trial::with_stem(candidate.law, u0, facts_.period_s, [&](auto make) {
    auto stem = make(OneOf<Trial>{candidate});
    for (std::size_t k = 0; k < v_.size(); ++k) v_[k] = static_cast<double>(stem.step(co_at(k)));
  });
}

namespace {

// A sticking stem as genes of the evolution, each from 0 to 1: logarithm of the force at which it
// slips, the share of the force that it slips, its start.
using Genes = std::array<double, 3>;
constexpr double kLeastForce = -1.0;  // log of %
constexpr double kMostForce = 3.7;
// For random stems, log of %.
constexpr double kLeastDrawn = -0.5;
constexpr double kMostDrawn = 3.4;

double gene_of_force(double log_force) noexcept {
  return (log_force - kLeastForce) / (kMostForce - kLeastForce);
}

}  // namespace

void WindowFitter::Search::evolve(int generations) {
  const auto genes_of = [](const Trial& c) {
    const double force = gene_of_force(std::log(0.5 * c.size * (1.0 + c.shape)));
    return Genes{std::clamp(force, 0.0, 1.0), std::clamp(2.0 * c.shape / (1.0 + c.shape), 0.0, 1.0),
                 0.5 * (c.start + 1.0)};
  };
  const auto express = [&](const Genes& genes) {
    Trial c = best;
    c.size = std::exp(kLeastForce + (kMostForce - kLeastForce) * genes[0]) * (2.0 - genes[1]);
    c.shape = genes[1] / (2.0 - genes[1]);
    c.start = 2.0 * genes[2] - 1.0;
    return c;
  };
  const auto judge = [&](std::span<const Genes> trials, std::span<double> costs) {
    std::transform(trials.begin(), trials.end(), lanes_.begin(), express);
    fitter_.evaluate(lanes_.data(), grain_);
    std::transform(lanes_.begin(), lanes_.end(), costs.begin(),
                   [](const Trial& c) { return c.misfit; });
  };
  // One random stream, the same for every window, so the result doesn't depend on chance. The
  // shipped networks were trained with it. With another stream, one in ten sticking windows gets
  // another fit.
  numeric::ShortRandom random;
  std::array<Genes, 2 * kStems> members;
  std::array<double, 2 * kStems> costs{};
  std::array<Genes, kStems> trials;
  std::array<double, kStems> trial_costs{};
  std::transform(kept_.begin(), kept_.end(), members.begin(), genes_of);
  for (std::size_t i = 0; i < kStems; ++i) {
    costs[i] = kept_[i].misfit;
    members[kStems + i] = {gene_of_force(random.uniform(kLeastDrawn, kMostDrawn)), random.uniform(),
                           random.uniform()};
  }
  judge(std::span(members).last(kStems), std::span(costs).last(kStems));
  const auto first = std::min_element(costs.begin(), costs.begin() + kStems) - costs.begin();
  const std::size_t found =
      numeric::evolve(numeric::Population<Genes>{members, costs, trials, trial_costs,
                                                 static_cast<std::size_t>(first)},
                      {.from = numeric::EvolutionSettings::From::own,
                       .trials = kStems * static_cast<std::size_t>(generations),
                       .crossover = 0.8,
                       .most_reach = 1.0},
                      random, judge);
  if (costs[found] >= best.misfit) return;
  best = express(members[found]);
  best.misfit = costs[found];
}

WindowFitter::Trial WindowFitter::search_play(FaultModel fault) noexcept {
  Search search(*this, Grain::block);
  const auto law = fault == FaultModel::backlash ? Trial::Law::play : Trial::Law::plays;
  for (const double start : kStarts) {
    search.try_eight([&](Trial& c, double i) {
      c.law = law;
      c.start = start;
      c.shape = 0.0;
      c.size = kSmallest * std::pow(kRatio, i);
    });
  }
  search.sizes(0.28, law);
  search.starts(0.14);
  return search.best;
}

WindowFitter::Trial WindowFitter::search_stiction() noexcept {
  Search search(*this, Grain::block);
  for (const double start : kStarts) {
    for (const double jump : kJumps) {
      search.try_eight([&](Trial& c, double i) {
        c.law = Trial::Law::he;
        c.start = start;
        c.shape = jump;
        c.size = kSmallest * std::pow(kRatio, i);
      });
      search.keep();
    }
  }
  if (search.best.misfit > enough_) search.evolve(kGenerations);
  search.jumps(0.12, 0.125, Trial::Law::choudhury);
  search.sizes(0.28, search.best.law);
  search.starts(0.14);
  return search.best;
}

WindowFitter::Trial WindowFitter::search_low_air() noexcept {
  Search search(*this, Grain::block);
  const double range = u_high_ - u_low_;
  for (const double short_of_top : {-0.05, 0.2, 0.5}) {
    for (const double lag_s : {0.1, 1.5}) {
      search.try_eight([&](Trial& c, double i) {
        c.law = Trial::Law::low_air;
        c.shape = 0.3 * std::pow(1.6, i);
        c.limit = u_high_ - short_of_top * range;
        c.lag_s = lag_s;
        c.start = 0.0;
      });
    }
  }
  search.air(0.28, range);
  return search.best;
}

}  // namespace loopwarden::specialist
