// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/sticking_cycle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "model/analysis/limits.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/subplex.hpp"
#include "model/plant/process.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"

namespace loopwarden::analysis {
namespace {

using Values = std::vector<double>;

constexpr std::array kThetas{0.0, 0.5, 0.8, 0.92, 0.97, 0.99, 1.0};
constexpr std::size_t kFirstTheta = 3;
constexpr std::size_t kStarts = 6;  // per ratio

struct Point {
  double s, ratio, lag_s, dead_s;
};

// The search ranges; each coordinate of the search is 0 to 1.
struct Ranges {
  double s_low, s_high, lag_low, lag_high, dead_high;

  Point at(const Values& x) const {
    return {s_low * std::pow(s_high / s_low, x[0]), x[1],
            lag_low * std::pow(lag_high / lag_low, x[2]), dead_high * x[3]};
  }
  Values place(const Point& p) const {
    return {std::log(p.s / s_low) / std::log(s_high / s_low), p.ratio,
            std::log(p.lag_s / lag_low) / std::log(lag_high / lag_low), p.dead_s / dead_high};
  }
};

struct Score {
  double deviance = std::numeric_limits<double>::infinity();
  double gain = 0.0;
};

struct Candidate {
  Point point;
  std::size_t theta;
  double deviance;
};

// The distance of two turns of `u`, samples, and the number of turns.
struct Reversals {
  std::size_t count = 0;
  double apart = 0.0;
};

Reversals reversals_of(std::span<const double> u, double band) {
  std::vector<double> at;
  double high = u.front();
  double low = u.front();
  int way = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    high = std::max(high, u[k]);
    low = std::min(low, u[k]);
    const bool up = way <= 0 && u[k] > low + band;
    const bool down = way >= 0 && u[k] < high - band;
    if (!up && !down) continue;
    if (way != 0) at.push_back(static_cast<double>(k));
    way = up ? 1 : -1;
    high = low = u[k];
  }
  Reversals reversals{at.size(), 0.0};
  Values apart;
  for (std::size_t i = 1; i < at.size(); ++i) apart.push_back(at[i] - at[i - 1]);
  if (!apart.empty()) reversals.apart = numeric::median(std::move(apart));
  return reversals;
}

class Search {
 public:
  Search(std::span<const double> co, std::span<const double> pv, double period_s)
      : co_(co), pv_(pv), period_s_(period_s) {
    for (const double u : co) mean_co_ += u / static_cast<double>(co.size());
    for (const double theta : kThetas) white_pv_.push_back(whitened(pv, theta));
  }

  // Leaves out one of the kBlocks blocks; kBlocks: leaves out no block.
  void leave_out(std::size_t block) noexcept { left_out_ = block; }

  Values stem(double s, double ratio) const {
    effects::StictionChoudhury valve({s, s * ratio});
    Values x(co_.size());
    x[0] = valve.reset(co_[0]);
    for (std::size_t k = 1; k < x.size(); ++k) x[k] = valve.step(co_[k]);
    return x;
  }

  // Returns the response of PV to the stem at gain 1; PV at k+1 follows from the stem at k.
  Values answer(const Values& x, double lag_s, double dead_s) const {
    plant::Process process({.gain = 1.0, .time_constant_s = lag_s, .dead_time_s = dead_s},
                           period_s_);
    Values q(x.size());
    q[0] = process.reset(x[0] - mean_co_);
    for (std::size_t k = 1; k < x.size(); ++k) q[k] = process.step(x[k - 1] - mean_co_);
    return q;
  }

  Score score(const Values& q, std::size_t theta) const {
    const Values white = whitened(q, kThetas[theta]);
    const Values& y = white_pv_[theta];
    double qq = 0.0;
    double qy = 0.0;
    double yy = 0.0;
    const std::size_t from = left_out_ * y.size() / Limits::kBlocks;
    const std::size_t to = (left_out_ + 1) * y.size() / Limits::kBlocks;
    for (std::size_t k = 0; k < y.size(); ++k) {
      if (k >= from && k < to) continue;
      qq += white[k] * white[k];
      qy += white[k] * y[k];
      yy += y[k] * y[k];
    }
    Score out;
    if (!(qq > 0.0)) return out;
    out.gain = std::max(0.0, qy / qq);
    const double left = yy - 2.0 * out.gain * qy + out.gain * out.gain * qq;
    const auto n = static_cast<double>(y.size());
    out.deviance = n * std::log(std::max(left, 1e-12 * yy) / n);
    return out;
  }

  Score score(const Point& p, std::size_t theta) const {
    return score(answer(stem(p.s, p.ratio), p.lag_s, p.dead_s), theta);
  }

  Values left(const Point& p, std::size_t theta) const {
    const Values q = answer(stem(p.s, p.ratio), p.lag_s, p.dead_s);
    const double gain = score(q, theta).gain;
    Values white = whitened(q, kThetas[theta]);
    for (std::size_t k = 0; k < white.size(); ++k) white[k] = white_pv_[theta][k] - gain * white[k];
    return white;
  }

  double mean_co() const noexcept { return mean_co_; }

 private:
  // Returns the column filtered by (1 - q)/(1 - theta q); if theta is 1, the column minus its mean.
  Values whitened(std::span<const double> column, double theta) const {
    Values out(column.size(), 0.0);
    if (theta == 1.0) {
      double mean = 0.0;
      for (const double v : column) mean += v / static_cast<double>(column.size());
      for (std::size_t k = 0; k < out.size(); ++k) out[k] = column[k] - mean;
      return out;
    }
    for (std::size_t k = 1; k < out.size(); ++k)
      out[k] = column[k] - column[k - 1] + theta * out[k - 1];
    return out;
  }

  std::span<const double> co_, pv_;
  double period_s_;
  double mean_co_ = 0.0;
  std::vector<Values> white_pv_;
  std::size_t left_out_ = Limits::kBlocks;
};

std::size_t best_theta(const Search& search, const Point& p) {
  const Values q = search.answer(search.stem(p.s, p.ratio), p.lag_s, p.dead_s);
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kThetas.size(); ++i) {
    const double deviance = search.score(q, i).deviance;
    if (deviance < least) {
      least = deviance;
      best = i;
    }
  }
  return best;
}

// Returns the best point of a search over the `free` directions.
Candidate refined(const Search& search, const Ranges& ranges, Candidate from,
                  const std::vector<std::size_t>& free, int evaluations) {
  for (int round = 0; round < 2; ++round) {
    const Values whole = ranges.place(from.point);
    const auto with = [&](const Values& own) {
      Values x = whole;
      for (std::size_t i = 0; i < free.size(); ++i) x[free[i]] = own[i];
      Point p = ranges.at(x);
      if (from.point.s == 0.0) p.s = 0.0;
      return p;
    };
    Values own;
    Values steps;
    for (const std::size_t i : free) {
      own.push_back(std::clamp(whole[i], 0.0, 1.0));
      steps.push_back(i == 0 ? 0.02 : 0.1);
    }
    numeric::subplex(own, steps, 0.0, 1.0,
                     [&](const Values& x) { return search.score(with(x), from.theta).deviance; },
                     {.most_evaluations = evaluations, .value_change = 0.01});
    Candidate tried{with(own), from.theta, 0.0};
    tried.deviance = search.score(tried.point, from.theta).deviance;
    if (!(tried.deviance < from.deviance)) tried = from;
    tried.theta = best_theta(search, tried.point);
    tried.deviance = search.score(tried.point, tried.theta).deviance;
    const bool same = tried.theta == from.theta;
    from = tried;
    if (same) break;
  }
  return from;
}

// Returns Student's t of the reduction of the squared error by the band, over blocks.
double block_t(const Values& without, const Values& with, double variance) {
  Values gains(Limits::kBlocks, 0.0);
  for (std::size_t k = 0; k < with.size(); ++k) {
    gains[k * Limits::kBlocks / with.size()] +=
        (without[k] * without[k] - with[k] * with[k]) / (2.0 * variance);
  }
  return numeric::mean(gains) * std::sqrt(static_cast<double>(Limits::kBlocks)) /
         std::max(numeric::deviation(gains), 1e-12);
}

}  // namespace

std::optional<StickingCycle> find_sticking_cycle(std::span<const double> whole_co,
                                                 std::span<const double> whole_pv,
                                                 double period_s) {
  if (whole_co.size() < Limits::kFewestCycleSamples) return std::nullopt;
  Values co;
  Values pv;
  const std::size_t every =
      (whole_co.size() + Limits::kMostCycleSamples - 1) / Limits::kMostCycleSamples;
  for (std::size_t k = 0; k + every <= whole_co.size(); k += every) {
    co.push_back(whole_co[k]);
    pv.push_back(whole_pv[k]);
  }
  const double h = period_s * static_cast<double>(every);
  Values sorted = co;
  const double range = numeric::quantile(sorted, 0.98) - numeric::quantile(sorted, 0.02);
  if (!(range > 0.0)) return std::nullopt;
  const Reversals reversals = reversals_of(co, Limits::kReversalBand * range);
  if (reversals.count < Limits::kFewestReversals) return std::nullopt;
  const double half_cycle_s = reversals.apart * h;
  const Ranges ranges{.s_low = 0.02 * range,
                      .s_high = 1.5 * range,
                      .lag_low = 0.2 * h,
                      .lag_high = std::max(2.0 * half_cycle_s, h),
                      .dead_high = std::max(0.8 * half_cycle_s, h)};
  Search search(co, pv, h);

  const Values grid_lag{0.1, 0.3, 0.5, 0.7, 0.9};
  const Values grid_dead{0.02, 0.1, 0.2, 0.35, 0.55, 0.8};
  std::vector<Candidate> straight;
  std::vector<Candidate> sticking;
  constexpr std::array kRatios{0.05, 0.3, 0.6, 0.95};
  for (std::size_t i = 0; i <= 18; ++i) {
    for (const double ratio : kRatios) {
      const bool none = i == 18;
      const Point band = ranges.at({0.25 + 0.04 * static_cast<double>(i), ratio, 0.0, 0.0});
      const Values x = search.stem(none ? 0.0 : band.s, ratio);
      for (const double lag : grid_lag) {
        for (const double dead : grid_dead) {
          Point p = ranges.at({0.0, ratio, lag, dead});
          p.s = none ? 0.0 : band.s;
          const double deviance =
              search.score(search.answer(x, p.lag_s, p.dead_s), kFirstTheta).deviance;
          (none ? straight : sticking).push_back({p, kFirstTheta, deviance});
        }
      }
      if (none) break;
    }
  }
  const auto less = [](const Candidate& a, const Candidate& b) { return a.deviance < b.deviance; };
  // Backlash and slips are different optima, so each ratio has starts at its best points.
  const auto best_of = [&](std::vector<Candidate>& all, const std::vector<std::size_t>& free) {
    std::sort(all.begin(), all.end(), less);
    std::vector<Candidate> reached;
    for (const double ratio : kRatios) {
      std::size_t taken = 0;
      for (std::size_t i = 0; i < all.size() && taken < kStarts; ++i) {
        if (all[i].point.ratio != ratio) continue;
        reached.push_back(refined(search, ranges, all[i], free, 250));
        ++taken;
      }
    }
    return *std::min_element(reached.begin(), reached.end(), less);
  };
  const Candidate line = best_of(straight, {2, 3});
  const Candidate stick = best_of(sticking, {0, 1, 2, 3});

  StickingCycle out;
  const auto n = static_cast<double>(co.size());
  out.lead_nats = (line.deviance - stick.deviance) / 2.0 - std::log(n);
  const Values left = search.left(stick.point, stick.theta);
  double variance = 0.0;
  for (const double v : left) variance += v * v / n;
  const Values x = search.stem(stick.point.s, stick.point.ratio);
  const auto [lowest, highest] = std::minmax_element(x.begin(), x.end());
  out.stem_reversals = reversals_of(x, Limits::kStemReversalBand * (*highest - *lowest)).count;
  if (out.lead_nats < Limits::kLeastLead || out.stem_reversals < Limits::kFewestStemReversals ||
      stick.point.s < Limits::kLeastBand * range ||
      ranges.place(stick.point)[2] > Limits::kLongestLagPlace ||
      block_t(search.left(line.point, stick.theta), left, variance) < Limits::kLeastT) {
    return std::nullopt;
  }
  const Values q = search.answer(x, stick.point.lag_s, stick.point.dead_s);
  const Score fitted = search.score(q, stick.theta);
  for (std::size_t k = 0; k < q.size(); ++k) out.level += (pv[k] - fitted.gain * q[k]) / n;
  double squares = 0.0;
  for (std::size_t k = 0; k < q.size(); ++k) {
    out.free_run.push_back(out.level + fitted.gain * q[k]);
    squares += std::pow(pv[k] - out.free_run.back(), 2.0);
  }
  out.every = every;
  out.noise_rms = std::sqrt(variance);
  out.rmse = std::sqrt(squares / n);
  out.fit_percent = 100.0 * (1.0 - out.rmse / numeric::deviation(pv));
  if (!(fitted.gain > 0.0)) return std::nullopt;
  out.mean_co = search.mean_co();
  const auto numbers = [&](const Candidate& c) {
    return std::array{c.point.s, c.point.s * c.point.ratio, search.score(c.point, c.theta).gain,
                      c.point.lag_s, c.point.dead_s};
  };
  const std::array of{&out.s, &out.j, &out.gain, &out.time_constant_s, &out.dead_time_s};
  const auto found = numbers(stick);
  for (std::size_t i = 0; i < of.size(); ++i) *of[i] = {found[i], found[i], found[i]};
  const auto reach = [&](const Candidate& c) {
    if (c.deviance > stick.deviance + Limits::kProfile) return;
    const auto here = numbers(c);
    for (std::size_t i = 0; i < of.size(); ++i) {
      of[i]->low = std::min(of[i]->low, here[i]);
      of[i]->high = std::max(of[i]->high, here[i]);
    }
  };
  for (int i = 0; i <= 20; ++i) {
    Candidate at = stick;
    at.point.ratio = 0.05 * i;
    at.deviance = search.score(at.point, at.theta).deviance;
    reach(refined(search, ranges, at, {0, 2, 3}, 80));
  }
  for (int i = -20; i <= 20; ++i) {
    Candidate at = stick;
    at.point.s *= 1.0 + 0.01 * i;
    at.point.ratio = std::min(1.0, stick.point.s * stick.point.ratio / at.point.s);
    at.deviance = search.score(at.point, at.theta).deviance;
    reach(at);
  }
  std::vector<std::array<double, 5>> without;
  for (std::size_t block = 0; block < Limits::kBlocks; ++block) {
    search.leave_out(block);
    Candidate at = stick;
    at.deviance = search.score(at.point, at.theta).deviance;
    without.push_back(numbers(refined(search, ranges, at, {0, 1, 2, 3}, 120)));
  }
  for (std::size_t i = 0; i < of.size(); ++i) {
    double mean = 0.0;
    double squares_apart = 0.0;
    for (const auto& w : without) mean += w[i] / static_cast<double>(Limits::kBlocks);
    for (const auto& w : without) squares_apart += (w[i] - mean) * (w[i] - mean);
    const double two = 1.96 * std::sqrt(squares_apart * (Limits::kBlocks - 1.0) / Limits::kBlocks);
    of[i]->low = std::max(0.0, std::min(of[i]->low, of[i]->value - two));
    of[i]->high = std::max(of[i]->high, of[i]->value + two);
  }
  return out;
}

}  // namespace loopwarden::analysis
