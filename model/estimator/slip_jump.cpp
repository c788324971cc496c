// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/slip_jump.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/estimator/band_filters.hpp"
#include "model/numeric/lanes.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {
namespace {

using numeric::every;
using numeric::kLanes;
using numeric::Lanes;

constexpr double kLeastPower = 1e-4;  // of the response about its mean, over all of it

// The stem slips when CO is (band + jump) / 2 away, to a distance of (band - jump) / 2. Then it
// rests (He 2007), or follows CO until CO turns (Choudhury 2005).
void pass_sticking_valve(const std::vector<float>& u, double band, bool follows, double side,
                         std::vector<Lanes>& out) {
  Lanes holds{}, keeps{};
  for (std::size_t i = 0; i < kLanes; ++i) {
    holds[i] = static_cast<float>(band * (1.0 + JumpGrid::kJumps[i]) / 2.0);
    keeps[i] = static_cast<float>(band * (1.0 - JumpGrid::kJumps[i]) / 2.0);
  }
  const Lanes zero = every<Lanes>(0.0);
  const Lanes one = every<Lanes>(1.0);
  Lanes stem = every<Lanes>(static_cast<double>(u.front()) - side * band / 2.0);
  Lanes moves = zero;  // direction
  out.resize(u.size());
  for (std::size_t k = 0; k < u.size(); ++k) {
    const Lanes at = every<Lanes>(static_cast<double>(u[k]));
    const Lanes change = every<Lanes>(static_cast<double>(k > 0 ? u[k] - u[k - 1] : 0.0F));
    if (follows) {
      moves = moves * change < zero ? zero : moves;
    } else {
      moves = zero;
    }
    moves = at - stem > holds ? one : stem - at > holds ? -one : moves;
    stem = moves == zero ? stem : at - moves * keeps;
    out[k] = stem;
  }
}

// Log-likelihoods of the jumps, summed over all else.
class JumpSums {
 public:
  JumpSums(std::span<const double> pv, std::span<const double> co, const BandEvidence& found)
      : found_(found) {
    sums_.fill(kNone);
    const numeric::Range range = numeric::range_of(co);
    const double movement = range.high - range.low;
    const double deviation = numeric::deviation(pv);
    if (movement <= 0.0 || deviation <= 0.0 || pv.size() <= 2 * BandGrid::kDelays.back()) return;
    const std::vector<float> y = scaled(pv, pv.front(), deviation);
    informative_ = informative_share(y);
    whiten(y, found.error, pv_);
    power_ = remove_mean(pv_);
    const std::vector<float> u = scaled(co, range.low, movement);
    const double band = found.band / movement;
    for (double at = JumpGrid::kLeastBand; at <= JumpGrid::kMostBand; at *= JumpGrid::kBandStep) {
      for (const bool follows : {false, true}) {
        for (const double side : {-1.0, 1.0}) {
          pass_sticking_valve(u, at * band, follows, side, stem_);
          for (std::size_t i = 0; i < kLanes; ++i) {
            reverses_[i] = reversals_of(stem_, i) >= BandGrid::kLeastReversals;
          }
          sum_over_processes(follows);
        }
      }
    }
  }

  double log_odds() const {
    double jumps = kNone;
    for (std::size_t i = 1; i < sums_.size(); ++i) {
      if (i != kLanes) jumps = log_add(jumps, sums_[i]);
    }
    const double without = log_add(sums_[0], sums_[kLanes]) - std::log(2.0);
    if (jumps == kNone || without == kNone) return 0.0;
    return std::clamp(jumps - std::log(2.0 * (kLanes - 1.0)) - without, -JumpGrid::kMostNats,
                      JumpGrid::kMostNats);
  }

 private:
  void sum_over_processes(bool follows) {
    for (const double lag : JumpGrid::kLags) {
      const double pole = 1.0 - std::min(1.0, (1.0 - found_.process.pole) / lag);
      pass_process(stem_, pole, rest_of(stem_, pole), response_);
      whiten(response_, found_.error, white_);
      for (std::size_t delay = std::max<std::size_t>(2, found_.process.delay) - 1;
           delay <= found_.process.delay + 1; ++delay) {
        sum_over_delay(delay, follows);
      }
    }
  }

  void sum_over_delay(std::size_t delay, bool follows) {
    Lanes along{}, own{}, sum{};
    for (std::size_t k = 0; k + delay < white_.size(); ++k) {
      along += white_[k] * every<Lanes>(static_cast<double>(pv_[k + delay]));
      own += white_[k] * white_[k];
      sum += white_[k];
    }
    const auto samples = static_cast<double>(pv_.size() - BandGrid::kSkipped);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double total = static_cast<double>(own[i]);
      const double mean = static_cast<double>(sum[i]);
      const double about_mean = total - mean * mean / samples;
      if (!reverses_[i] || about_mean <= kLeastPower * total) continue;
      const double product = static_cast<double>(along[i]);
      const double left = std::max(power_ - product * product / about_mean, 1e-9 * power_);
      double& log_sum = sums_[i + (follows ? kLanes : 0)];
      log_sum = log_add(log_sum, -0.5 * informative_ * samples * std::log(left / samples));
    }
  }

  BandEvidence found_;
  double informative_ = 1.0;
  double power_ = 0.0;     // of the whitened PV
  std::vector<float> pv_;  // whitened
  std::vector<Lanes> stem_, response_, white_;
  std::array<bool, kLanes> reverses_{};
  std::array<double, 2 * kLanes> sums_{};  // by law and jump
};

}  // namespace

double find_slip_jump(std::span<const double> pv, std::span<const double> co,
                      const BandEvidence& band) {
  const std::vector<double> y = block_means(pv, band.factor);
  const std::vector<double> u = block_means(co, band.factor);
  const std::vector<RecordPiece> pieces = pieces_of(y.size());
  double sum = 0.0;
  for (const auto [from, size] : pieces) {
    sum += JumpSums(std::span(y).subspan(from, size), std::span(u).subspan(from, size), band)
               .log_odds();
  }
  return sum / static_cast<double>(pieces.size());
}

}  // namespace loopwarden::estimator
