// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/hammerstein.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/diagnosis/limits.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::array kArxBands{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.95};
constexpr std::size_t kLongestDelay = 8;
constexpr std::size_t kInputLags = kLongestDelay + 2;  // v(k-1) to v(k-10)
constexpr std::size_t kOwnLags = 3;
constexpr std::size_t kMostBlocks = 2000;  // longer records are averaged first

using Parts = std::array<double, Limits::kParts>;

void take_out(Series& x, const Series& q) {
  const double share = dot(x, q.data());
  for (std::size_t k = 0; k < x.size(); ++k) x[k] -= share * q[k];
}

struct HammersteinFit {
  double rss = 0.0;
  std::size_t dead_time = 0;
  bool found = false;
  double first = 0.0;  // b1, b2
  double second = 0.0;
};

// PV without the part that its own past, a constant and a trend explain. The inputs are orthogonal
// to the same columns, so each dead time is a regression on two columns.
class OneStepAhead {
 public:
  explicit OneStepAhead(const Series& y) : count_(y.size() - kInputLags) {
    weights_.fill(1.0);
    build(y);
    weigh_parts();
    build(y);
  }

  // `action` other than 0: only fits whose gain has its sign.
  HammersteinFit fit(const Series& v, double action) const {
    std::array<double, kInputLags> with_rest{};
    std::array<double, kInputLags> own{};
    std::array<double, kInputLags> with_next{};
    std::array<std::array<double, kOwnLags + 2>, kInputLags> along{};
    for (std::size_t lag = 1; lag <= kInputLags; ++lag) {
      const double* column = v.data() + (kInputLags - lag);
      for (std::size_t q = 0; q < weighted_basis_.size(); ++q) {
        along[lag - 1][q] = dot(weighted_basis_[q], column);
      }
      with_rest[lag - 1] = dot(weighted_rest_, column);
      for (std::size_t p = 0; p < Limits::kParts; ++p) {
        const std::size_t from = start(p);
        const std::size_t size = start(p + 1) - from;
        const double square = weights_[p] * weights_[p];
        own[lag - 1] += square * dot(column + from, column + from, size);
        if (lag < kInputLags)
          with_next[lag - 1] += square * dot(column + from, column + from - 1, size);
      }
    }
    for (std::size_t l = 0; l < kInputLags; ++l) {
      for (std::size_t q = 0; q < basis_.size(); ++q) {
        own[l] -= along[l][q] * along[l][q];
        if (l + 1 < kInputLags) with_next[l] -= along[l][q] * along[l + 1][q];
      }
    }
    HammersteinFit best{.rss = power_};
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
      const double first = (bb * ya - ab * yb) / determinant;
      const double second = (aa * yb - ab * ya) / determinant;
      if (power_ - gained >= best.rss || action * (first + second) < 0.0) continue;
      best = {.rss = std::max(power_ - gained, 1e-12 * power_),
              .dead_time = d,
              .found = true,
              .first = first,
              .second = second};
    }
    return best;
  }

  // Returns the sum of squares of the fit's error, part by part.
  Parts left_by(const HammersteinFit& fit, const Series& v) const {
    Series left = rest_;
    if (fit.found) {
      const double* first = v.data() + (kInputLags - 1 - fit.dead_time);
      Series input(count_);
      for (std::size_t p = 0; p < Limits::kParts; ++p) {
        for (std::size_t k = start(p); k < start(p + 1); ++k) {
          input[k] = weights_[p] * (fit.first * first[k] + fit.second * *(first + k - 1));
        }
      }
      for (const Series& q : basis_) take_out(input, q);
      for (std::size_t k = 0; k < count_; ++k) left[k] -= input[k];
    }
    return power_by_part(left);
  }
  double power() const { return power_; }

 private:
  std::size_t start(std::size_t part) const { return part * count_ / Limits::kParts; }
  Parts power_by_part(const Series& x) const {
    Parts powers{};
    for (std::size_t p = 0; p < Limits::kParts; ++p) {
      powers[p] = dot(x.data() + start(p), x.data() + start(p), start(p + 1) - start(p));
    }
    return powers;
  }

  void build(const Series& y) {
    std::array<Series, kOwnLags + 2> columns;
    for (Series& c : columns) c.resize(count_);
    rest_.resize(count_);
    basis_.clear();
    weighted_basis_.clear();
    for (std::size_t p = 0; p < Limits::kParts; ++p) {
      const double w = weights_[p];
      for (std::size_t i = start(p); i < start(p + 1); ++i) {
        const std::size_t k = i + kInputLags;
        rest_[i] = w * y[k];
        columns[0][i] = w;
        columns[1][i] = w * (static_cast<double>(i) / static_cast<double>(count_) - 0.5);
        for (std::size_t lag = 1; lag <= kOwnLags; ++lag) columns[1 + lag][i] = w * y[k - lag];
      }
    }
    for (Series& c : columns) {
      const double before = dot(c, c.data());
      for (const Series& q : basis_) take_out(c, q);
      const double norm = dot(c, c.data());
      if (norm <= 1e-12 * before) continue;
      for (double& v : c) v /= std::sqrt(norm);
      basis_.push_back(c);
    }
    for (const Series& q : basis_) take_out(rest_, q);
    power_ = dot(rest_, rest_.data());
    weighted_rest_ = weighted(rest_);
    for (const Series& q : basis_) weighted_basis_.push_back(weighted(q));
  }

  Series weighted(Series x) const {
    for (std::size_t p = 0; p < Limits::kParts; ++p) {
      for (std::size_t k = start(p); k < start(p + 1); ++k) x[k] *= weights_[p];
    }
    return x;
  }

  void weigh_parts() {
    const Parts powers = power_by_part(rest_);
    const double middle = numeric::median({powers.begin(), powers.end()});
    if (middle <= 0.0) return;
    for (std::size_t p = 0; p < Limits::kParts; ++p) {
      weights_[p] = std::sqrt(middle / std::max(powers[p], Limits::kQuietest * middle));
    }
  }

  std::size_t count_;
  Parts weights_{};
  std::vector<Series> basis_;  // of the weighted rows
  Series rest_;
  double power_ = 0.0;
  std::vector<Series> weighted_basis_;  // with the weights applied twice, for inputs as they are
  Series weighted_rest_;
};

std::size_t reversals_of(const Series& v) {
  std::size_t count = 0;
  double direction = 0.0;
  for (std::size_t k = 1; k < v.size(); ++k) {
    const double change = v[k] - v[k - 1];
    if (change == 0.0) continue;
    if (change * direction < 0.0) ++count;
    direction = change;
  }
  return count;
}

Hammerstein fit_blocks(Series y, Series u, double action) {
  Hammerstein h;
  const double deviation = numeric::deviation(y);
  const double range = numeric::quantile(u, 0.98) - numeric::quantile(u, 0.02);
  if (deviation <= 0.0 || range <= 0.0) return h;
  const double level = numeric::mean(y);
  for (double& value : y) value = (value - level) / deviation;
  const double start = u.front();
  for (double& value : u) value = (value - start) / range;
  const OneStepAhead ahead(y);
  if (ahead.power() <= 0.0) return h;
  const HammersteinFit linear = ahead.fit(u, 0.0);
  HammersteinFit best{.rss = std::numeric_limits<double>::infinity()};
  Series best_input;
  Series v(u.size());
  const auto consider = [&](double s, bool jumps) {
    const std::size_t reversals = reversals_of(v);
    if (reversals < Limits::kLeastValveReversals) return;
    const HammersteinFit fit = ahead.fit(v, action);
    if (fit.rss >= best.rss) return;
    best = fit;
    h.reversals = reversals;
    best_input = v;
    h.band_share = s;
    h.jumps = jumps;
  };
  for (const double s : kArxBands) {
    effects::Backlash play(s);
    play.reset(u.front());
    std::transform(u.begin(), u.end(), v.begin(), [&](double x) { return play.step(x); });
    consider(s, false);
    effects::StictionChoudhury law({.s = s, .j = 0.5 * s});
    law.reset(u.front());
    std::transform(u.begin(), u.end(), v.begin(), [&](double x) { return law.step(x); });
    consider(s, true);
  }
  if (best_input.empty()) return h;
  const Parts straight = ahead.left_by(linear, u);
  const Parts through = ahead.left_by(best, best_input);
  const double least = 1e-9 * ahead.power();
  Series gains;
  double in_favour = 0.0;
  for (std::size_t p = 0; p < Limits::kParts; ++p) {
    gains.push_back(std::clamp(std::log((straight[p] + least) / (through[p] + least)),
                               Limits::kLowestGain, Limits::kHighestGain));
    in_favour += gains.back() > 0.0 ? 1.0 : 0.0;
  }
  h.evidence = numeric::mean(gains);
  h.parts_for = in_favour / static_cast<double>(Limits::kParts);
  h.band = h.band_share * range;
  h.dead_time = best.dead_time;
  return h;
}

}  // namespace

Hammerstein fit_hammerstein(std::span<const double> pv, std::span<const double> co, double action) {
  Hammerstein best;
  const std::size_t first = std::max<std::size_t>(1, (pv.size() + kMostBlocks - 1) / kMostBlocks);
  for (std::size_t block = first; pv.size() / block >= Limits::kLeastBlocks; block *= 2) {
    Hammerstein h = fit_blocks(block_means(pv, block), block_means(co, block), action);
    h.block = block;
    if (h.band_share > 0.0 && (best.block == 0 || h.evidence > best.evidence)) best = h;
  }
  return best;
}

}  // namespace loopwarden::diagnosis
