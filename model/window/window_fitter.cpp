// SPDX-License-Identifier: Apache-2.0
#include "model/window/window_fitter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "model/numeric/evolution.hpp"
#include "model/numeric/lanes.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/backlash.hpp"
#include "model/plant/hysteresis_offset.hpp"
#include "model/plant/hysteresis_width.hpp"
#include "model/plant/low_air_supply.hpp"
#include "model/plant/stiction_choudhury.hpp"
#include "model/plant/stiction_he.hpp"

namespace loopwarden::specialist {
namespace {

constexpr std::size_t kStems = 8;     // candidates tried in step
constexpr double kLeastNoise = 0.01;  // % of span: converters are no better
constexpr double kMostMissing = 0.1;  // share of the window
constexpr double kFewestBlocks = 60;

// Priors: standard deviations, relative to gain, dead time (plus a block) and time constant.
struct Prior {
  double gain;
  double dead_time;
  double lag;
};
constexpr Prior kBelieved{0.05, 0.06, 0.10};
constexpr Prior kUnsure{0.5, 0.5, 0.5};

// Of the gain while a grid is searched: as far as belief may be off.
constexpr float kGainLow = 0.88F;
constexpr float kGainHigh = 1.12F;

// Sizes of the grid, % of CO span.
constexpr double kSmallest = 0.8;
constexpr double kRatio = 1.6;
constexpr std::array kStarts{0.0, 1.0, -1.0};
constexpr std::array kJumps{0.2, 0.5, 0.9};
// Of the evolution of a sticking stem. Twice as many find little more.
constexpr int kGenerations = 50;
constexpr int kFineGenerations = 30;
constexpr int kMostSteps = 3;  // of a play's size in one direction, in the end
// Mean square over the noise's at which there is nothing left to search for.
constexpr double kEnough = 1.2;

using numeric::Lanes;
static_assert(kStems == 2 * numeric::kLanes);

Lanes every(float value) noexcept { return numeric::every<Lanes>(static_cast<double>(value)); }

// Of a gradual hysteresis: the plant's has twelve, which a window can't tell from four.
constexpr std::size_t kPlays = 4;

}  // namespace

LoopFacts facts_of(const plant::LoopModel& model) {
  const control::PidSettings& pid = model.controller.pid;
  return {model.sample_time_s,       model.process.gain,    model.process.time_constant_s,
          model.process.dead_time_s, pid.output_low,        pid.output_high,
          model.transmitter.low,     model.transmitter.high};
}

// One stem to try: which law, its numbers in % and blocks, and where the stem starts, -1 to 1 of what friction
// or play leaves free.
struct WindowFitter::Trial {
  enum class Law { none, play, plays, he, choudhury, low_air };
  Law law = Law::none;
  double size = 0.0;
  double shape = 0.0;
  double start = 0.0;
  double limit = 1e9;  // % less the mean of u
  double lag_s = 0.0;
  double misfit = std::numeric_limits<double>::infinity();

  // Hands `walk` what makes the plant's stem of `law`, at rest at `u0` and stepped every `period_s`: a
  // function of `put`, which makes a number, or a row of them, of a value of the candidates.
  template <class Walk>
  static void with_stem(Law law, double u0, double period_s, Walk walk) noexcept {
    const auto static_friction = [](const Trial& x) { return x.size * (1.0 + x.shape) / 2.0; };
    const auto moving_friction = [](const Trial& x) { return x.size * (1.0 - x.shape) / 2.0; };
    const auto stuck_at = [=](const Trial& x) { return u0 + x.start * static_friction(x); };
    switch (law) {
      case Law::none: return;
      case Law::play:
        return walk([=](auto put) {
          return plant::PlayLaw<typename decltype(put)::Number>{
              put([](const Trial& x) { return x.size / 2.0; }),
              put([=](const Trial& x) { return u0 + x.start * x.size / 2.0; })};
        });
      case Law::plays:
        return walk([=](auto put) {
          plant::PlaysLaw<typename decltype(put)::Number, kPlays> stem;
          for (std::size_t i = 0; i < kPlays; ++i) {
            const auto half = [i](const Trial& x) {
              return plant::half_deadbands<kPlays>(x.size, x.shape)[i];
            };
            stem.plays[i] = {put(half),
                             put([=](const Trial& x) { return u0 + x.start * half(x); })};
          }
          return stem;
        });
      case Law::he:
        return walk([=](auto put) {
          return plant::HeLaw<typename decltype(put)::Number>{put(static_friction),
                                                              put(moving_friction), put(stuck_at)};
        });
      case Law::choudhury:
        return walk([=](auto put) {
          return plant::ChoudhuryLaw<typename decltype(put)::Number>{
              put(static_friction), put(moving_friction), put(stuck_at),
              put([=](const Trial&) { return u0; }), put([](const Trial&) { return 0.0; })};
        });
      case Law::low_air:
        return walk([=](auto put) {
          using Stem = plant::LowAirLaw<typename decltype(put)::Number>;
          return Stem({.limit = put([](const Trial& x) { return x.limit; }),
                       .share = put([](const Trial&) { return 1.0; }),
                       .rate = put([](const Trial& x) { return x.shape; }),
                       .lag_s = put([](const Trial& x) { return x.lag_s; })},
                      period_s,
                      put([=](const Trial& x) { return std::min(u0, x.limit) + x.start; }));
        });
    }
  }
};

namespace {

// What a stem is made of: one candidate's values, or those of as many in step as there are lanes.
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

namespace {

constexpr int kMostRounds = 24;
constexpr double kMostOff = 2.5;  // standard deviations

// Normal equations of at most four unknowns, the lower triangle. What is not asked for has no say.
struct System {
  std::array<std::array<double, 4>, 4> normal{};
  std::array<double, 4> right{};
};

// Ridge regression, positive definite by the prior: each unknown and what of it is `taken` already stays as near
// to 0 as `deviation` and `trust` ask.
Eigen::Vector4d solved(const System& system, const Eigen::Vector4d& deviation,
                       const Eigen::Vector4d& taken, double trust) noexcept {
  using Rows = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  Eigen::Matrix4d normal = Eigen::Map<const Rows>(system.normal.front().data());
  const Eigen::Vector4d weight = trust * deviation.cwiseAbs2().cwiseInverse();
  normal.diagonal() += weight;
  const Eigen::Vector4d right =
      Eigen::Map<const Eigen::Vector4d>(system.right.data()) - weight.cwiseProduct(taken);
  return normal.llt().solve(right);
}

}  // namespace

WindowFitter::WindowFitter(const LoopFacts& facts) : facts_(facts) {
  const double h = facts.period_s;
  samples_per_block_ =
      static_cast<std::size_t>(std::clamp(std::floor(facts.time_constant_s / (4.0 * h)), 1.0, 4.0));
  delay_ = static_cast<std::size_t>(
               std::clamp(std::round(facts.dead_time_s / h), 0.0, 0.5 * kWindowSamples)) +
           1;
  blocks_ = (kWindowSamples - delay_) / samples_per_block_;
  block_s_ = h * static_cast<double>(samples_per_block_);
  const double x = block_s_ / facts.time_constant_s;
  keep_ = std::exp(-x);
  mean_keep_ = (1.0 - keep_) / x;
  for (auto& column : basis_) column.resize(blocks_);
  for (std::size_t b = 0; b < blocks_; ++b) {
    const double t = (static_cast<double>(b) + 0.5) * block_s_;
    basis_[0][b] = 1.0;
    basis_[1][b] = t;
    basis_[2][b] = std::exp(-t / facts.time_constant_s);
  }
  for (std::size_t i = 0; i < basis_.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      double along = 0.0;
      for (std::size_t b = 0; b < blocks_; ++b) along += basis_[i][b] * basis_[k][b];
      for (std::size_t b = 0; b < blocks_; ++b) basis_[i][b] -= along * basis_[k][b];
    }
    double square = 0.0;
    for (const double value : basis_[i]) square += value * value;
    for (double& value : basis_[i]) value /= std::sqrt(square);
    basis_lanes_[i].assign(basis_[i].begin(), basis_[i].end());
  }
  pv_.resize(kWindowSamples);
  co_.resize(kWindowSamples);
  co_lanes_.resize(kWindowSamples);
  falling_.resize(kWindowSamples);
  v_.resize(blocks_ * samples_per_block_);
  for (auto* column : {&u_, &target_}) column->resize(blocks_);
  for (auto& column : columns_) column.resize(blocks_);
  u_lanes_.resize(blocks_);
  target_lanes_.resize(blocks_);
}

void WindowFitter::project(std::vector<double>& column) const noexcept {
  for (const std::vector<double>& direction : basis_) {
    double along = 0.0;
    for (std::size_t b = 0; b < blocks_; ++b) along += column[b] * direction[b];
    for (std::size_t b = 0; b < blocks_; ++b) column[b] -= along * direction[b];
  }
}

bool WindowFitter::prepare(const LoopWindow& window, WindowFits& found) noexcept {
  if (window.pv.size() != kWindowSamples || window.co.size() != kWindowSamples) return false;
  if (static_cast<double>(blocks_) < kFewestBlocks) return false;
  const double co_scale = 100.0 / (facts_.co_high - facts_.co_low);
  const double pv_scale = co_scale / facts_.gain;
  std::size_t missing = 0;
  const auto fill = [&](std::span<const double> from, std::vector<double>& to, double zero,
                        double scale) {
    double last = 0.0;
    for (const double value : from) {
      if (std::isfinite(value)) {
        last = (value - zero) * scale;
        break;
      }
    }
    for (std::size_t k = 0; k < kWindowSamples; ++k) {
      if (std::isfinite(from[k])) {
        last = (from[k] - zero) * scale;
      } else {
        ++missing;
      }
      to[k] = last;
    }
  };
  fill(window.pv, pv_, 0.0, pv_scale);
  fill(window.co, co_, facts_.co_low, co_scale);
  if (static_cast<double>(missing) > kMostMissing * kWindowSamples) return false;

  const auto m = samples_per_block_;
  const double share = 1.0 / static_cast<double>(m);
  u_mean_ = 0.0;
  plant::FallingLaw branch{.last_u = co_[0]};
  for (std::size_t k = 0; k < kWindowSamples; ++k) falling_[k] = branch.step(co_[k]) ? 1.0F : 0.0F;
  for (std::size_t b = 0; b < blocks_; ++b) {
    double u = 0.0;
    double p = 0.0;
    for (std::size_t i = 0; i < m; ++i) {
      u += co_[b * m + i];
      p += pv_[b * m + i + delay_];
    }
    u_[b] = u * share;
    u_mean_ += u_[b];
    target_[b] = p * share;
  }
  u_mean_ /= static_cast<double>(blocks_);
  const auto [low, high] = std::minmax_element(target_.begin(), target_.end());
  found.pv_range = *high - *low;
  // Second differences of white noise have six times its variance. Slips and spikes are cut off at three
  // standard deviations of the first estimate.
  double square = 0.0;
  for (const double most : {std::numeric_limits<double>::infinity(), 9.0}) {
    const double limit = most * square;
    double sum = 0.0;
    for (std::size_t k = 2; k < kWindowSamples; ++k) {
      const double d = pv_[k] - 2.0 * pv_[k - 1] + pv_[k - 2];
      sum += std::isfinite(limit) ? std::min(d * d, limit) : d * d;
    }
    square = sum / static_cast<double>(kWindowSamples - 2);
  }
  found.noise = std::max(kLeastNoise, std::sqrt(square * share / 6.0));
  enough_ = kEnough * found.noise * found.noise * static_cast<double>(blocks_);
  project(target_);
  target_square_ = 0.0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    u_[b] -= u_mean_;
    u_lanes_[b] = static_cast<float>(u_[b]);
    target_lanes_[b] = static_cast<float>(target_[b]);
    target_square_ += target_[b] * target_[b];
  }
  for (std::size_t k = 0; k < kWindowSamples; ++k) {
    co_lanes_[k] = static_cast<float>(co_[k] - u_mean_);
  }
  const auto [u_low, u_high] = std::minmax_element(u_.begin(), u_.end());
  u_low_ = *u_low;
  u_high_ = *u_high;
  return true;
}

void WindowFitter::measure_movement(WindowFits& found) const noexcept {
  found.co_range = u_high_ - u_low_;
  double extreme = u_[0];
  double direction = 0.0;
  const double least_turn = 4.0 * found.noise;
  std::size_t shut = 0;
  for (std::size_t b = 1; b < blocks_; ++b) {
    const double change = u_[b] - u_[b - 1];
    found.co_travel += std::abs(change);
    found.co_fastest = std::max(found.co_fastest, std::abs(change) / block_s_);
    const double co = u_[b] + u_mean_;
    if (co < 0.1 || co > 99.9) ++shut;
    const double away = u_[b] - extreme;
    if (direction == 0.0) {
      if (std::abs(away) > least_turn) direction = std::copysign(1.0, away);
    } else if (away * direction < -least_turn) {
      ++found.reversals;
      direction = -direction;
      extreme = u_[b];
    }
    if (away * direction > 0.0) extreme = u_[b];
  }
  found.shut_share = static_cast<double>(shut) / static_cast<double>(blocks_);
}

// What a row of candidates leaves of the target once gain and basis have taken their best.
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

// A row of stems with the lag behind them.
template <class Stem>
struct WindowFitter::Row {
  Stem stem;
  Lanes state;
  Projection sums;
  Row(const Stem& at_rest, float u0) noexcept
      : stem(at_rest), state(stem.step(every(u0))), sums{.first = state} {}
};

// A batch of stems block by block; each gets the misfit that its best gain leaves.
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

// The same sample by sample, with the process as it was found.
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

// `candidates` are a batch of one law.
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

// The stem of one candidate into v_, sample by sample.
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

// A search keeps the best of all that it tries.
class WindowFitter::Search {
 public:
  Search(const WindowFitter& fitter, Grain grain) : fitter_(fitter), grain_(grain) {}

  // `change` makes lane i of eight from the best one so far.
  template <class Change>
  void try_eight(Change change) {
    for (std::size_t i = 0; i < kStems; ++i) {
      lanes_[i] = best;
      change(lanes_[i], static_cast<double>(i));
    }
    fitter_.evaluate(lanes_.data(), grain_);
    Trial found = best;
    for (const Trial& c : lanes_) {
      if (c.misfit < found.misfit) found = c;
    }
    best = found;
  }
  void sizes(double step, Trial::Law law) {
    try_eight([&](Trial& c, double i) {
      c.law = law;
      c.size *= std::pow(kRatio, step * (i - 3.5));
    });
  }
  void starts(double step) {
    try_eight(
        [&](Trial& c, double i) { c.start = std::clamp(c.start + step * (i - 3.5), -1.0, 1.0); });
  }
  // Where the stem starts to move stays: s + j.
  void jumps(double low, double step, Trial::Law law) {
    try_eight([&](Trial& c, double i) {
      c.law = law;
      const double shape = std::clamp(low + step * i, 0.0, 1.0);
      c.size *= (1.0 + c.shape) / (1.0 + shape);
      c.shape = shape;
    });
  }
  void knees(double low, double step) {
    try_eight([&](Trial& c, double i) { c.shape = std::clamp(low + step * i, -1.2, 0.7); });
  }
  void air(double step, double range) {
    try_eight([&](Trial& c, double i) { c.limit += step * 0.3 * range * (i - 3.5); });
    try_eight([&](Trial& c, double i) { c.shape *= std::pow(1.6, step * (i - 3.5)); });
    try_eight([&](Trial& c, double i) { c.lag_s *= std::pow(2.0, 2.0 * step * (i - 3.5)); });
    // A stem that was still on its way when the window began.
    try_eight([&](Trial& c, double i) { c.start += step * 0.5 * range * (i - 3.5); });
  }

  // The eight just tried, where they are among the best eight of all.
  void keep() {
    const auto worse = [](const Trial& a, const Trial& b) { return a.misfit < b.misfit; };
    for (const Trial& c : lanes_) {
      Trial& worst = *std::max_element(kept_.begin(), kept_.end(), worse);
      if (c.misfit < worst.misfit) worst = c;
    }
  }
  void keep_best_alone() { kept_.fill(best); }
  // Differential evolution of a stem that sticks: the misfit jumps wherever a slip comes or goes, so that no
  // descent gets far. Starts from the kept ones and as many by chance.
  void evolve(int generations);

  Trial best;

 private:
  const WindowFitter& fitter_;
  Grain grain_;
  std::array<Trial, kStems> lanes_;
  std::array<Trial, kStems> kept_;
};

namespace {

// A sticking stem as evolution sees it, each from 0 to 1: log of the force at which it slips, how much of that it
// slips, its start.
using Genes = std::array<double, 3>;
constexpr double kLeastForce = -1.0;  // log of %
constexpr double kMostForce = 3.7;
// Of stems drawn by chance, log of %.
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
  // One stream, the same for every window: what a window shows must not depend on chance. The shipped networks
  // have learned what it finds; with another one in ten sticking windows is fitted otherwise.
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

void WindowFitter::believe(double dead_time_off_s, double lag_off_s) noexcept {
  process_.shift = static_cast<std::ptrdiff_t>(std::lround(dead_time_off_s / facts_.period_s));
  process_.dead_time_off_s = static_cast<double>(process_.shift) * facts_.period_s;
  process_.time_constant_s =
      std::max(0.2 * facts_.time_constant_s, facts_.time_constant_s + lag_off_s);
  process_.keep = std::exp(-facts_.period_s / process_.time_constant_s);
}

FaultFit WindowFitter::settle(FaultModel fault, const Trial& start, double noise) noexcept {
  believe(0.0, 0.0);
  FaultFit best = fit_stem(fault, start, noise);
  Search search(*this, Grain::sample);
  search.best = start;
  const double range = u_high_ - u_low_;
  for (const bool coarse : {true, false}) {
    const double step = coarse ? 0.28 : 0.09;
    believe(best.dead_time_off_s, best.lag_off_s);
    // What it left before was with another process.
    search.best.misfit = std::numeric_limits<double>::infinity();
    switch (search.best.law) {
      case Trial::Law::none: break;
      case Trial::Law::play:
        search.sizes(step, Trial::Law::play);
        search.starts(0.5 * step);
        break;
      case Trial::Law::plays:
        search.knees(search.best.shape - 3.5 * step, step);
        search.sizes(step, Trial::Law::plays);
        search.starts(0.5 * step);
        break;
      case Trial::Law::he:
      case Trial::Law::choudhury: {
        if (coarse && best.mse * static_cast<double>(blocks_) > enough_) {
          search.keep_best_alone();
          search.evolve(kFineGenerations);
        }
        const double low = search.best.shape - 1.6 * step;
        search.jumps(low, 0.45 * step, Trial::Law::he);
        search.jumps(low, 0.45 * step, Trial::Law::choudhury);
        search.sizes(step, search.best.law);
        search.starts(0.5 * step);
        search.sizes(0.3 * step, search.best.law);
        break;
      }
      case Trial::Law::low_air: search.air(step, range); break;
    }
    const FaultFit now = fit_stem(fault, search.best, noise);
    if (now.mse < best.mse) best = now;
  }
  if (search.best.law == Trial::Law::play || search.best.law == Trial::Law::plays) {
    // Play and dead time stand in for each other: both at once, where the searches above take turns.
    for (const double ratio : {1.06, 1.0 / 1.06, 1.02, 1.0 / 1.02}) {
      for (int i = 0; i < kMostSteps; ++i) {
        Trial next = search.best;
        next.size *= ratio;
        const FaultFit now = fit_stem(fault, next, noise);
        if (now.mse >= best.mse) break;
        best = now;
        search.best = next;
      }
    }
  }
  return best;
}

FaultFit WindowFitter::fit_stem(FaultModel fault, const Trial& candidate, double noise) noexcept {
  trace(candidate);
  const double time_constant = process_.time_constant_s;
  const double keep = process_.keep;
  double y = v_[0];
  double lagged_slope = 0.0;
  double offset = static_cast<double>(falling_at(0));
  double largest = 0.0;
  const double share = 1.0 / static_cast<double>(samples_per_block_);
  std::size_t k = 0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    std::array<double, 4> sums{};
    for (std::size_t i = 0; i < samples_per_block_; ++i, ++k) {
      const double v = v_[k];
      y = v + keep * (y - v);
      const double slope = (v - y) / time_constant;
      // T z' + z = -y'
      lagged_slope = -slope + keep * (lagged_slope + slope);
      const double falling = static_cast<double>(falling_at(k));
      offset = falling + keep * (offset - falling);
      sums[0] += y;
      sums[1] += slope;
      sums[2] += lagged_slope;
      sums[3] += offset;
      largest = std::max(largest, std::abs(static_cast<double>(co_at(k)) - v));
    }
    for (std::size_t i = 0; i < columns_.size(); ++i) columns_[i][b] = sums[i] * share;
  }
  const Prior& prior = fault == FaultModel::other_process ? kUnsure : kBelieved;
  const bool with_offset = fault == FaultModel::hysteresis_offset;
  const std::size_t count = with_offset ? 4 : 3;
  // The last one's is no prior at all.
  const Eigen::Vector4d deviation{prior.gain,
                                  prior.dead_time * facts_.dead_time_s + 0.5 * facts_.period_s,
                                  prior.lag * facts_.time_constant_s, 1e3};
  // What of it the process has taken up already.
  const Eigen::Vector4d taken{0.0, -process_.dead_time_off_s,
                              time_constant - facts_.time_constant_s, 0.0};
  for (std::size_t i = 0; i < count; ++i) project(columns_[i]);
  System system;
  for (std::size_t b = 0; b < blocks_; ++b) {
    const double left = target_[b] - columns_[0][b];
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j <= i; ++j) system.normal[i][j] += columns_[i][b] * columns_[j][b];
      system.right[i] += columns_[i][b] * left;
    }
  }
  Eigen::Vector4d solution;
  // What a belief may be off by is bounded, however little noise there is to outweigh: the prior gains weight
  // until all are within.
  double trust = 4.0 * noise * noise;
  for (int round = 0; round < kMostRounds; ++round, trust *= 4.0) {
    solution = solved(system, deviation, taken, trust);
    const Eigen::Vector4d off = (taken + solution).cwiseQuotient(deviation);
    if (off.head<3>().cwiseAbs().maxCoeff() <= kMostOff) break;
  }
  FaultFit result;
  double slow = 0.0;
  double squares = 0.0;
  double innovations = 0.0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    double r = target_[b] - columns_[0][b];
    for (std::size_t i = 0; i < count; ++i)
      r -= solution(static_cast<Eigen::Index>(i)) * columns_[i][b];
    const double innovation = r - slow;
    slow += 0.25 * innovation;
    squares += r * r;
    innovations += innovation * innovation;
  }
  const auto n = static_cast<double>(blocks_);
  result.mse = squares / n;
  result.innovation = innovations / n;
  result.dead_time_off_s = -(taken[1] + solution[1]);
  result.lag_off_s = taken[2] + solution[2];
  result.gain_off = solution[0] / deviation[0];
  result.dead_time_off = result.dead_time_off_s / deviation[1];
  result.lag_off = result.lag_off_s / deviation[2];
  result.size = candidate.size;
  result.shape = candidate.shape;
  if (with_offset) result.size = solution[3];
  if (fault == FaultModel::low_air_supply) {
    result.size = largest;
    result.limit = std::max(0.0, u_high_ - candidate.limit);
  }
  return result;
}

WindowFits WindowFitter::fit(const LoopWindow& window) noexcept {
  WindowFits found;
  if (!prepare(window, found)) return found;
  found.usable = true;
  measure_movement(found);
  const Trial healthy;
  const auto put = [&](FaultModel e, const Trial& c) {
    found.fits[static_cast<std::size_t>(e)] = settle(e, c, found.noise);
  };
  put(FaultModel::healthy, healthy);
  put(FaultModel::other_process, healthy);
  put(FaultModel::backlash, search_play(FaultModel::backlash));
  put(FaultModel::stiction, search_stiction());
  put(FaultModel::hysteresis_width, search_play(FaultModel::hysteresis_width));
  put(FaultModel::hysteresis_offset, healthy);
  put(FaultModel::low_air_supply, search_low_air());
  return found;
}

}  // namespace loopwarden::specialist
