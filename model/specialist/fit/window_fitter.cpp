// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/fit/window_fitter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "model/effects/hysteresis/hysteresis_offset.hpp"
#include "model/specialist/fit/stem_search.hpp"

namespace loopwarden::specialist {
namespace {

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

constexpr int kFineGenerations = 30;
constexpr int kMostSteps = 3;  // of a backlash's size in one direction, in the final search
// Mean square over that of the noise at which the search has converged.
constexpr double kEnough = 1.2;

}  // namespace

LoopFacts facts_of(const plant::LoopModel& model) {
  const control::PidSettings& pid = model.controller.pid;
  return {model.sample_time_s,       model.process.gain,    model.process.time_constant_s,
          model.process.dead_time_s, pid.output_low,        pid.output_high,
          model.transmitter.low,     model.transmitter.high};
}

namespace {

constexpr int kMostRounds = 24;
constexpr double kMostOff = 2.5;  // standard deviations

// Normal equations of at most four unknowns, the lower triangle. Unused unknowns have no effect.
struct System {
  std::array<std::array<double, 4>, 4> normal{};
  std::array<double, 4> right{};
};

// Ridge regression, positive definite by the prior. `deviation` and `trust` keep each unknown,
// including its `taken` part, near to 0.
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

bool WindowFitter::prepare(const numeric::LoopView& window, WindowFits& found) noexcept {
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
  effects::FallingLaw branch{.last_u = co_[0]};
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
  // Second differences of white noise have six times its variance. Slips and spikes are cut off at
  // three standard deviations of the first estimate.
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
    // Its error so far was with another process.
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
    // Backlash and dead time have similar effects. Vary both at once, because the searches above
    // alternate.
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
  // The offset has no prior.
  const Eigen::Vector4d deviation{prior.gain,
                                  prior.dead_time * facts_.dead_time_s + 0.5 * facts_.period_s,
                                  prior.lag * facts_.time_constant_s, 1e3};
  // The part that the process contains already.
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
  // The error of the assumed process is bounded, even with little noise: the prior gets more weight
  // until all values are within the bound.
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

WindowFits WindowFitter::fit(const numeric::LoopView& window) noexcept {
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
