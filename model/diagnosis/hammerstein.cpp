// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/hammerstein.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/plant/backlash.hpp"
#include "model/plant/stiction_choudhury.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::array kArxBands{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95};
constexpr std::array kBlocksPerPeriod{10.0, 20.0, 40.0};
constexpr std::size_t kLongestDelay = 8;
constexpr std::size_t kInputLags = kLongestDelay + 2;  // v(k-1) to v(k-10)
constexpr std::size_t kOwnLags = 3;
constexpr std::size_t kLeastBlocks = 100;
constexpr double kLowest = -0.15;
constexpr double kHighest = 0.4;

// Four sums side by side: one alone waits for each addition.
double dot(const double* a, const double* b, std::size_t count) {
  std::array<double, 4> sums{};
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    for (std::size_t i = 0; i < 4; ++i) sums[i] += a[k + i] * b[k + i];
  }
  double rest = 0.0;
  for (; k < count; ++k) rest += a[k] * b[k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest;
}
double dot(const Series& a, const double* b) { return dot(a.data(), b, a.size()); }

// PV less what its own past, a constant and a trend explain; the inputs are made orthogonal to the same, so that each dead
// time is a regression on two columns.
class OneStepAhead {
 public:
  explicit OneStepAhead(const Series& y) : count_(y.size() - kInputLags) {
    std::array<Series, kOwnLags + 2> columns;
    for (Series& c : columns) c.resize(count_);
    rest_.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t k = i + kInputLags;
      rest_[i] = y[k];
      columns[0][i] = 1.0;
      columns[1][i] = static_cast<double>(i) / static_cast<double>(count_) - 0.5;
      for (std::size_t lag = 1; lag <= kOwnLags; ++lag) columns[1 + lag][i] = y[k - lag];
    }
    for (Series& c : columns) {
      const double before = dot(c, c.data());
      for (const Series& q : basis_) remove(c, q);
      const double norm = dot(c, c.data());
      if (norm <= 1e-12 * before) continue;
      for (double& v : c) v /= std::sqrt(norm);
      basis_.push_back(c);
    }
    for (const Series& q : basis_) remove(rest_, q);
    power_ = dot(rest_, rest_.data());
  }

  // Least sum of squares over the dead times.
  double residual(const Series& v) const {
    std::array<double, kInputLags> with_rest{};
    std::array<double, kInputLags> own{};
    std::array<double, kInputLags> with_next{};
    std::array<std::vector<double>, kInputLags> along;
    for (std::size_t lag = 1; lag <= kInputLags; ++lag) {
      const double* column = v.data() + (kInputLags - lag);
      auto& a = along[lag - 1];
      a.reserve(basis_.size());
      for (const Series& q : basis_) a.push_back(dot(q, column));
      with_rest[lag - 1] = dot(rest_, column);
      own[lag - 1] = dot(column, column, count_);
      if (lag < kInputLags) with_next[lag - 1] = dot(column, column - 1, count_);
    }
    for (std::size_t l = 0; l < kInputLags; ++l) {
      for (std::size_t q = 0; q < basis_.size(); ++q) {
        own[l] -= along[l][q] * along[l][q];
        if (l + 1 < kInputLags) with_next[l] -= along[l][q] * along[l + 1][q];
      }
    }
    double best = power_;
    for (std::size_t d = 0; d <= kLongestDelay; ++d) {
      const double ridge = 1e-10 * (own[d] + own[d + 1]);
      const double aa = own[d] + ridge;
      const double bb = own[d + 1] + ridge;
      const double ab = with_next[d];
      const double determinant = aa * bb - ab * ab;
      if (determinant <= 1e-12 * aa * bb) continue;
      const double ya = with_rest[d];
      const double yb = with_rest[d + 1];
      const double gained = (bb * ya * ya - 2.0 * ab * ya * yb + aa * yb * yb) / determinant;
      best = std::min(best, power_ - gained);
    }
    return std::max(best, 1e-12 * power_);
  }
  double power() const { return power_; }

 private:
  static void remove(Series& x, const Series& q) {
    const double share = dot(x, q.data());
    for (std::size_t k = 0; k < x.size(); ++k) x[k] -= share * q[k];
  }
  std::size_t count_;
  std::vector<Series> basis_;
  Series rest_;
  double power_ = 0.0;
};

}  // namespace

Hammerstein fit_hammerstein(std::span<const double> pv, std::span<const double> co, double period) {
  Hammerstein result;
  Series bands;
  double sum = 0.0;
  double jumps = 0.0;
  for (const double per_period : kBlocksPerPeriod) {
    const auto wanted = static_cast<std::size_t>(period / per_period);
    const std::size_t factor =
        std::clamp<std::size_t>(wanted, 1, std::max<std::size_t>(1, pv.size() / kLeastBlocks));
    Series y = block_means(pv, factor);
    Series u = block_means(co, factor);
    if (y.size() < kLeastBlocks / 2) continue;
    const double deviation = std::sqrt(variance(y));
    const double range = quantile(u, 0.98) - quantile(u, 0.02);
    if (deviation <= 0.0 || range <= 0.0) continue;
    const double level = mean(y);
    for (double& value : y) value = (value - level) / deviation;
    const double start = u.front();
    for (double& value : u) value = (value - start) / range;
    const OneStepAhead ahead(y);
    if (ahead.power() <= 0.0) continue;
    const double linear = ahead.residual(u);
    double best = std::numeric_limits<double>::infinity();
    double band = 0.0;
    bool jump = false;
    Series v(u.size());
    const auto consider = [&](double s, bool jumps_at_it) {
      const double rss = ahead.residual(v);
      if (rss >= best) return;
      best = rss;
      band = s;
      jump = jumps_at_it;
    };
    for (const double s : kArxBands) {
      plant::Backlash play(s);
      play.reset(u.front());
      std::transform(u.begin(), u.end(), v.begin(), [&](double x) { return play.step(x); });
      consider(s, false);
      plant::StictionChoudhury law({.s = s, .j = 0.5 * s});
      law.reset(u.front());
      std::transform(u.begin(), u.end(), v.begin(), [&](double x) { return law.step(x); });
      consider(s, true);
    }
    sum += std::clamp(std::log(linear / best), kLowest, kHighest);
    bands.push_back(band * range);
    jumps += jump ? 1.0 : 0.0;
  }
  if (bands.empty()) return result;
  const auto count = static_cast<double>(bands.size());
  result.evidence = sum / count;
  result.jump_share = jumps / count;
  result.band = quantile(bands, 0.5);
  return result;
}

}  // namespace loopwarden::diagnosis
