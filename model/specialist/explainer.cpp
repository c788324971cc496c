// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/explainer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopwarden::specialist {
namespace {

constexpr std::size_t kLanes = 8;
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

using Pack = float __attribute__((vector_size(16)));
using Mask = int __attribute__((vector_size(16)));

Pack pack(float value) noexcept { return Pack{value, value, value, value}; }
Pack least(Pack a, Pack b) noexcept { return a < b ? a : b; }
Pack most(Pack a, Pack b) noexcept { return a > b ? a : b; }
Pack size_of(Pack a) noexcept { return most(a, -a); }

}  // namespace

LoopFacts facts_of(const plant::LoopModel& model) {
  const control::PidSettings& pid = model.controller.pid;
  return {model.sample_time_s,       model.process.gain,    model.process.time_constant_s,
          model.process.dead_time_s, pid.output_low,        pid.output_high,
          model.transmitter.low,     model.transmitter.high};
}

// One stem to try: which law, its numbers in % and blocks, and where the stem starts, -1 to 1 of what friction
// or play leaves free.
struct Explainer::Candidate {
  enum class Law { none, play, plays, he, choudhury, low_air };
  Law law = Law::none;
  double size = 0.0;
  double shape = 0.0;
  double start = 0.0;
  double limit = 1e9;  // % less the mean of u
  double lag_s = 0.0;
  double misfit = std::numeric_limits<double>::infinity();
};

namespace {

// Four or one stem in step with a scalar or a pack of them: `Number` is either.
template <class Number>
struct Arithmetic;
template <>
struct Arithmetic<float> {
  static float least(float a, float b) noexcept { return std::min(a, b); }
  static float most(float a, float b) noexcept { return std::max(a, b); }
  static float size(float a) noexcept { return std::abs(a); }
  static float same(float a) noexcept { return a; }
};
template <>
struct Arithmetic<Pack> {
  static Pack least(Pack a, Pack b) noexcept { return specialist::least(a, b); }
  static Pack most(Pack a, Pack b) noexcept { return specialist::most(a, b); }
  static Pack size(Pack a) noexcept { return size_of(a); }
  static Pack same(float a) noexcept { return pack(a); }
};

template <class N>
struct PlayStem {
  N half;
  N x;
  N step(N u) noexcept {
    using A = Arithmetic<N>;
    return x = A::most(A::least(x, u + half), u - half);
  }
};

template <class N>
struct PlaysStem {
  static constexpr std::array<float, 4> kPlaces{0.25F, 0.75F, 1.25F, 1.75F};
  N half;
  N x[4];
  N step(N u) noexcept {
    using A = Arithmetic<N>;
    N sum = A::same(0.0F);
    for (std::size_t i = 0; i < 4; ++i) {
      const N h = half * A::same(kPlaces[i]);
      x[i] = A::most(A::least(x[i], u + h), u - h);
      sum = sum + x[i];
    }
    return sum * A::same(0.25F);
  }
};

template <class N>
struct HeStem {
  N hold;
  N drag;
  N x;
  N step(N u) noexcept {
    using A = Arithmetic<N>;
    const N r = u - x;
    const N slipped = r > A::same(0.0F) ? u - drag : u + drag;
    return x = A::size(r) > hold ? slipped : x;
  }
};

template <class N>
struct ChoudhuryStem {
  N hold;
  N drag;
  N x;
  N last;
  N direction;  // -1, 0, 1
  N step(N u) noexcept {
    using A = Arithmetic<N>;
    const N zero = A::same(0.0F);
    const N change = u - last;
    last = u;
    direction = change * direction > zero ? direction : zero;
    const N r = u - x;
    const N way = r > zero ? A::same(1.0F) : A::same(-1.0F);
    const N starts = A::size(r) > hold ? way : zero;
    direction = A::size(direction) > zero ? direction : starts;
    return x = A::size(direction) > zero ? u - direction * drag : x;
  }
};

template <class N>
struct LowAirStem {
  N most_change;  // per block
  N share;        // of the distance, per block
  N limit;
  N x;
  N step(N u) noexcept {
    using A = Arithmetic<N>;
    const N change = (A::least(u, limit) - x) * share;
    x = x + A::most(A::least(change, most_change), -most_change);
    return x;
  }
};

constexpr int kMostRounds = 24;
constexpr double kMostOff = 2.5;  // standard deviations

using System = std::array<std::array<double, 5>, 4>;  // lower triangle and right-hand side

// Ridge regression by Cholesky: at most four unknowns, positive definite by the prior.
std::array<double, 4> solved(System system, std::size_t count,
                             const std::array<double, 4>& deviation, double trust) noexcept {
  std::array<double, 4> solution{};
  for (std::size_t i = 0; i < count; ++i) {
    system[i][i] += trust / (deviation[i] * deviation[i]);
    for (std::size_t k = 0; k <= i; ++k) {
      double sum = system[i][k];
      for (std::size_t j = 0; j < k; ++j) sum -= system[i][j] * system[k][j];
      system[i][k] = i == k ? std::sqrt(std::max(sum, 1e-300)) : sum / system[k][k];
    }
    double sum = system[i][4];
    for (std::size_t j = 0; j < i; ++j) sum -= system[i][j] * solution[j];
    solution[i] = sum / system[i][i];
  }
  for (std::size_t i = count; i-- > 0;) {
    for (std::size_t j = i + 1; j < count; ++j) solution[i] -= system[j][i] * solution[j];
    solution[i] /= system[i][i];
  }
  return solution;
}

}  // namespace

Explainer::Explainer(const LoopFacts& facts) : facts_(facts) {
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
  for (auto* column : {&u_, &falling_, &target_, &v_, &residual_}) column->resize(blocks_);
  for (auto& column : columns_) column.resize(blocks_);
  u_lanes_.resize(blocks_);
  target_lanes_.resize(blocks_);
}

void Explainer::project(std::vector<double>& column) const noexcept {
  for (const std::vector<double>& direction : basis_) {
    double along = 0.0;
    for (std::size_t b = 0; b < blocks_; ++b) along += column[b] * direction[b];
    for (std::size_t b = 0; b < blocks_; ++b) column[b] -= along * direction[b];
  }
}

bool Explainer::prepare(const LoopWindow& window, Findings& findings) noexcept {
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
  double falls = 0.0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    double u = 0.0;
    double p = 0.0;
    double falling = 0.0;
    for (std::size_t i = 0; i < m; ++i) {
      const std::size_t k = b * m + i;
      u += co_[k];
      p += pv_[k + delay_];
      if (k > 0 && co_[k] != co_[k - 1]) falls = co_[k] < co_[k - 1] ? 1.0 : 0.0;
      falling += falls;
    }
    u_[b] = u * share;
    u_mean_ += u_[b];
    falling_[b] = falling * share;
    target_[b] = p * share;
  }
  u_mean_ /= static_cast<double>(blocks_);
  const auto [low, high] = std::minmax_element(target_.begin(), target_.end());
  findings.pv_range = *high - *low;
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
  findings.noise = std::max(kLeastNoise, std::sqrt(square * share / 6.0));
  project(target_);
  target_square_ = 0.0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    u_[b] -= u_mean_;
    u_lanes_[b] = static_cast<float>(u_[b]);
    target_lanes_[b] = static_cast<float>(target_[b]);
    target_square_ += target_[b] * target_[b];
  }
  const auto [u_low, u_high] = std::minmax_element(u_.begin(), u_.end());
  u_low_ = *u_low;
  u_high_ = *u_high;
  return true;
}

void Explainer::measure_movement(Findings& findings) const noexcept {
  findings.co_range = u_high_ - u_low_;
  double extreme = u_[0];
  double direction = 0.0;
  const double least_turn = 4.0 * findings.noise;
  std::size_t shut = 0;
  for (std::size_t b = 1; b < blocks_; ++b) {
    const double change = u_[b] - u_[b - 1];
    findings.co_travel += std::abs(change);
    findings.co_fastest = std::max(findings.co_fastest, std::abs(change) / block_s_);
    const double co = u_[b] + u_mean_;
    if (co < 0.1 || co > 99.9) ++shut;
    const double away = u_[b] - extreme;
    if (direction == 0.0) {
      if (std::abs(away) > least_turn) direction = std::copysign(1.0, away);
    } else if (away * direction < -least_turn) {
      ++findings.reversals;
      direction = -direction;
      extreme = u_[b];
    }
    if (away * direction > 0.0) extreme = u_[b];
  }
  findings.shut_share = static_cast<double>(shut) / static_cast<double>(blocks_);
}

// Eight stems through the lag at once; each gets the misfit that its best gain leaves.
template <class Lanes>
void Explainer::try_lanes(Candidate* candidates, Lanes lanes) const noexcept {
  const Pack keep = pack(static_cast<float>(keep_));
  const Pack take = pack(static_cast<float>(1.0 - keep_));
  const Pack mean_keep = pack(static_cast<float>(mean_keep_));
  const Pack mean_take = pack(static_cast<float>(1.0 - mean_keep_));
  const Pack zero = pack(0.0F);
  Pack state[2] = {zero, zero};
  Pack square[2] = {zero, zero};
  Pack with_target[2] = {zero, zero};
  Pack along[3][2] = {{zero, zero}, {zero, zero}, {zero, zero}};
  for (std::size_t p = 0; p < 2; ++p) state[p] = lanes[p].step(pack(u_lanes_[0]));
  for (std::size_t b = 0; b < blocks_; ++b) {
    const Pack u = pack(u_lanes_[b]);
    const Pack target = pack(target_lanes_[b]);
    for (std::size_t p = 0; p < 2; ++p) {
      const Pack v = lanes[p].step(u);
      const Pack y = mean_keep * state[p] + mean_take * v;
      state[p] = keep * state[p] + take * v;
      square[p] = square[p] + y * y;
      with_target[p] = with_target[p] + y * target;
      for (std::size_t i = 0; i < 3; ++i) {
        along[i][p] = along[i][p] + y * pack(basis_lanes_[i][b]);
      }
    }
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::size_t p = lane / 4;
    const std::size_t i = lane % 4;
    float own = square[p][i];
    for (std::size_t k = 0; k < 3; ++k) own -= along[k][p][i] * along[k][p][i];
    const float both = with_target[p][i];
    const float gain = std::clamp(own > 0.0F ? both / own : 1.0F, kGainLow, kGainHigh);
    candidates[lane].misfit =
        target_square_ + static_cast<double>(gain * (gain * own - 2.0F * both));
  }
}

// `candidates` are eight of one law.
void Explainer::evaluate(Candidate* candidates) const noexcept {
  const auto u0 = static_cast<double>(u_lanes_[0]);
  Pack a[2];
  Pack b[2];
  Pack c[2];
  Pack d[2];
  const auto set = [&](Pack* to, auto value) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      to[lane / 4][lane % 4] = static_cast<float>(value(candidates[lane]));
    }
  };
  switch (candidates[0].law) {
    case Candidate::Law::none: return;
    case Candidate::Law::play: {
      set(a, [](const Candidate& x) { return x.size / 2.0; });
      set(b, [&](const Candidate& x) { return u0 + x.start * x.size / 2.0; });
      PlayStem<Pack> lanes[2] = {{a[0], b[0]}, {a[1], b[1]}};
      return try_lanes<PlayStem<Pack>*>(candidates, lanes);
    }
    case Candidate::Law::plays: {
      set(a, [](const Candidate& x) { return x.size / 2.0; });
      PlaysStem<Pack> lanes[2];
      for (std::size_t p = 0; p < 2; ++p) lanes[p].half = a[p];
      for (std::size_t i = 0; i < 4; ++i) {
        const double place = static_cast<double>(PlaysStem<Pack>::kPlaces[i]);
        set(b, [&](const Candidate& x) { return u0 + place * x.start * x.size / 2.0; });
        for (std::size_t p = 0; p < 2; ++p) lanes[p].x[i] = b[p];
      }
      return try_lanes<PlaysStem<Pack>*>(candidates, lanes);
    }
    case Candidate::Law::he:
    case Candidate::Law::choudhury: {
      set(a, [](const Candidate& x) { return x.size * (1.0 + x.shape) / 2.0; });
      set(b, [](const Candidate& x) { return x.size * (1.0 - x.shape) / 2.0; });
      set(c, [&](const Candidate& x) { return u0 + x.start * x.size * (1.0 + x.shape) / 2.0; });
      if (candidates[0].law == Candidate::Law::he) {
        HeStem<Pack> lanes[2] = {{a[0], b[0], c[0]}, {a[1], b[1], c[1]}};
        return try_lanes<HeStem<Pack>*>(candidates, lanes);
      }
      const Pack at = pack(u_lanes_[0]);
      const Pack zero = pack(0.0F);
      ChoudhuryStem<Pack> lanes[2] = {{a[0], b[0], c[0], at, zero}, {a[1], b[1], c[1], at, zero}};
      return try_lanes<ChoudhuryStem<Pack>*>(candidates, lanes);
    }
    case Candidate::Law::low_air: {
      set(a, [&](const Candidate& x) { return x.shape * block_s_; });
      set(b, [&](const Candidate& x) { return 1.0 - std::exp(-block_s_ / x.lag_s); });
      set(c, [](const Candidate& x) { return x.limit; });
      set(d, [&](const Candidate& x) { return std::min(u0, x.limit) + x.start; });
      LowAirStem<Pack> lanes[2] = {{a[0], b[0], c[0], d[0]}, {a[1], b[1], c[1], d[1]}};
      return try_lanes<LowAirStem<Pack>*>(candidates, lanes);
    }
  }
}

// The stem of one candidate into v_.
void Explainer::trace(const Candidate& x) noexcept {
  const auto u0 = static_cast<double>(u_lanes_[0]);
  const auto number = [](double value) { return static_cast<float>(value); };
  const auto walk = [&](auto stem) {
    for (std::size_t b = 0; b < blocks_; ++b) v_[b] = static_cast<double>(stem.step(u_lanes_[b]));
  };
  switch (x.law) {
    case Candidate::Law::none: std::copy(u_.begin(), u_.end(), v_.begin()); return;
    case Candidate::Law::play:
      return walk(PlayStem<float>{number(x.size / 2.0), number(u0 + x.start * x.size / 2.0)});
    case Candidate::Law::plays: {
      PlaysStem<float> stem{number(x.size / 2.0), {}};
      for (std::size_t i = 0; i < 4; ++i) {
        const double place = static_cast<double>(PlaysStem<float>::kPlaces[i]);
        stem.x[i] = number(u0 + place * x.start * x.size / 2.0);
      }
      return walk(stem);
    }
    case Candidate::Law::he:
      return walk(HeStem<float>{number(x.size * (1.0 + x.shape) / 2.0),
                                number(x.size * (1.0 - x.shape) / 2.0),
                                number(u0 + x.start * x.size * (1.0 + x.shape) / 2.0)});
    case Candidate::Law::choudhury:
      return walk(ChoudhuryStem<float>{
          number(x.size * (1.0 + x.shape) / 2.0), number(x.size * (1.0 - x.shape) / 2.0),
          number(u0 + x.start * x.size * (1.0 + x.shape) / 2.0), u_lanes_[0], 0.0F});
    case Candidate::Law::low_air:
      return walk(LowAirStem<float>{number(x.shape * block_s_),
                                    number(1.0 - std::exp(-block_s_ / x.lag_s)), number(x.limit),
                                    number(std::min(u0, x.limit) + x.start)});
  }
}

Explainer::Candidate Explainer::search_play(Explanation explanation) noexcept {
  Candidate best;
  std::array<Candidate, kLanes> lanes;
  const auto law =
      explanation == Explanation::backlash ? Candidate::Law::play : Candidate::Law::plays;
  const auto keep_best = [&] {
    evaluate(lanes.data());
    for (const Candidate& c : lanes) {
      if (c.misfit < best.misfit) best = c;
    }
  };
  for (const double start : kStarts) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = Candidate{};
      lanes[i].law = law;
      lanes[i].start = start;
      lanes[i].size = kSmallest * std::pow(kRatio, static_cast<double>(i));
    }
    keep_best();
  }
  for (const double step : {0.28, 0.07}) {
    const Candidate centre = best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = centre;
      lanes[i].size = centre.size * std::pow(kRatio, step * (static_cast<double>(i) - 3.5));
    }
    keep_best();
    const Candidate sized = best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = sized;
      lanes[i].start =
          std::clamp(sized.start + 0.5 * step * (static_cast<double>(i) - 3.5), -1.0, 1.0);
    }
    keep_best();
  }
  return best;
}

Explainer::Candidate Explainer::search_stiction() noexcept {
  Candidate best;
  std::array<Candidate, kLanes> lanes;
  const auto keep_best = [&] {
    evaluate(lanes.data());
    for (const Candidate& c : lanes) {
      if (c.misfit < best.misfit) best = c;
    }
  };
  for (const double start : kStarts) {
    for (const double jump : kJumps) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        lanes[i] = Candidate{};
        lanes[i].law = Candidate::Law::he;
        lanes[i].start = start;
        lanes[i].shape = jump;
        lanes[i].size = kSmallest * std::pow(kRatio, static_cast<double>(i));
      }
      keep_best();
    }
  }
  const auto around_size = [&](double step, Candidate::Law law) {
    const Candidate centre = best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = centre;
      lanes[i].law = law;
      lanes[i].size = centre.size * std::pow(kRatio, step * (static_cast<double>(i) - 3.5));
    }
    keep_best();
  };
  const auto around_jump = [&](Candidate::Law law) {
    const Candidate centre = best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = centre;
      lanes[i].law = law;
      lanes[i].shape = 0.12 + 0.125 * static_cast<double>(i);
      // Where it starts to move stays: s + j.
      lanes[i].size = centre.size * (1.0 + centre.shape) / (1.0 + lanes[i].shape);
    }
    keep_best();
  };
  const auto around_start = [&](double step) {
    const Candidate centre = best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = centre;
      lanes[i].start = std::clamp(centre.start + step * (static_cast<double>(i) - 3.5), -1.0, 1.0);
    }
    keep_best();
  };
  around_jump(Candidate::Law::choudhury);
  around_size(0.28, best.law);
  around_start(0.14);
  around_jump(best.law);
  around_size(0.28, Candidate::Law::he);
  around_jump(best.law);
  around_size(0.07, best.law);
  return best;
}

Explainer::Candidate Explainer::search_low_air() noexcept {
  Candidate best;
  std::array<Candidate, kLanes> lanes;
  const double range = u_high_ - u_low_;
  const auto keep_best = [&] {
    evaluate(lanes.data());
    for (const Candidate& c : lanes) {
      if (c.misfit < best.misfit) best = c;
    }
  };
  for (const double short_of_top : {-0.05, 0.2, 0.5}) {
    for (const double lag_s : {0.1, 1.5}) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        lanes[i] = Candidate{};
        lanes[i].law = Candidate::Law::low_air;
        lanes[i].shape = 0.3 * std::pow(1.6, static_cast<double>(i));
        lanes[i].limit = u_high_ - short_of_top * range;
        lanes[i].lag_s = lag_s;
      }
      keep_best();
    }
  }
  const auto around = [&](auto change) {
    const Candidate centre = best;
    for (std::size_t i = 0; i < kLanes; ++i) {
      lanes[i] = centre;
      change(lanes[i], static_cast<double>(i) - 3.5);
    }
    keep_best();
  };
  for (const double step : {0.28, 0.07}) {
    around([&](Candidate& c, double i) { c.limit += step * 0.3 * range * i; });
    around([&](Candidate& c, double i) { c.shape *= std::pow(1.6, step * i); });
    around([&](Candidate& c, double i) { c.lag_s *= std::pow(2.0, 2.0 * step * i); });
    // A stem that was still on its way when the window began.
    around([&](Candidate& c, double i) { c.start += step * 0.5 * range * i; });
  }
  return best;
}

Fit Explainer::fit(Explanation explanation, const Candidate& candidate, double noise) noexcept {
  trace(candidate);
  const double time_constant = facts_.time_constant_s;
  double state = v_[0];
  double lagged_slope = 0.0;
  double offset_state = falling_[0];
  double largest = 0.0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    const double v = v_[b];
    const double y = v + mean_keep_ * (state - v);
    const double slope = (v - y) / time_constant;
    columns_[0][b] = y;
    columns_[1][b] = slope;
    // T z' + z = -y', mean over the block likewise.
    columns_[2][b] = -slope + mean_keep_ * (lagged_slope + slope);
    lagged_slope = -slope + keep_ * (lagged_slope + slope);
    state = v + keep_ * (state - v);
    columns_[3][b] = falling_[b] + mean_keep_ * (offset_state - falling_[b]);
    offset_state = falling_[b] + keep_ * (offset_state - falling_[b]);
    largest = std::max(largest, std::abs(u_[b] - v));
  }
  const Prior& prior = explanation == Explanation::other_process ? kUnsure : kBelieved;
  const bool with_offset = explanation == Explanation::hysteresis_offset;
  const std::size_t count = with_offset ? 4 : 3;
  // The last one's is no prior at all.
  const std::array<double, 4> deviation{
      prior.gain, prior.dead_time * facts_.dead_time_s + 0.5 * facts_.period_s,
      prior.lag * time_constant, 1e3};
  for (std::size_t i = 0; i < count; ++i) project(columns_[i]);
  System system{};
  for (std::size_t b = 0; b < blocks_; ++b) {
    const double left = target_[b] - columns_[0][b];
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k <= i; ++k) system[i][k] += columns_[i][b] * columns_[k][b];
      system[i][4] += columns_[i][b] * left;
    }
  }
  std::array<double, 4> solution{};
  // What a belief may be off by is bounded, however little noise there is to outweigh: the prior gains weight
  // until all are within.
  double trust = 4.0 * noise * noise;
  for (int round = 0; round < kMostRounds; ++round, trust *= 4.0) {
    solution = solved(system, count, deviation, trust);
    double worst = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      worst = std::max(worst, std::abs(solution[i]) / deviation[i]);
    }
    if (worst <= kMostOff) break;
  }
  Fit result;
  double slow = 0.0;
  double squares = 0.0;
  double innovations = 0.0;
  for (std::size_t b = 0; b < blocks_; ++b) {
    double r = target_[b] - columns_[0][b];
    for (std::size_t i = 0; i < count; ++i) r -= solution[i] * columns_[i][b];
    const double innovation = r - slow;
    slow += 0.25 * innovation;
    squares += r * r;
    innovations += innovation * innovation;
  }
  const auto n = static_cast<double>(blocks_);
  result.mse = squares / n;
  result.innovation = innovations / n;
  result.gain_off = solution[0] / deviation[0];
  result.dead_time_off = -solution[1] / deviation[1];
  result.lag_off = solution[2] / deviation[2];
  result.size = candidate.size;
  result.shape = candidate.shape;
  if (with_offset) result.size = solution[3];
  if (explanation == Explanation::low_air_supply) {
    result.size = largest;
    result.limit = std::max(0.0, u_high_ - candidate.limit);
  }
  return result;
}

Findings Explainer::explain(const LoopWindow& window) noexcept {
  Findings findings;
  if (!prepare(window, findings)) return findings;
  findings.usable = true;
  measure_movement(findings);
  const Candidate healthy;
  const auto put = [&](Explanation e, const Candidate& c) {
    findings.fits[static_cast<std::size_t>(e)] = fit(e, c, findings.noise);
  };
  put(Explanation::healthy, healthy);
  put(Explanation::other_process, healthy);
  put(Explanation::backlash, search_play(Explanation::backlash));
  put(Explanation::stiction, search_stiction());
  put(Explanation::hysteresis_width, search_play(Explanation::hysteresis_width));
  put(Explanation::hysteresis_offset, healthy);
  put(Explanation::low_air_supply, search_low_air());
  return findings;
}

}  // namespace loopwarden::specialist
