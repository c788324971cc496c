// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/band.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "model/estimator/band_filters.hpp"
#include "model/numeric/lanes.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {
namespace {

using numeric::every;
using numeric::kLanes;
using numeric::Lanes;
using Grid = BandGrid;
using Doubles = std::vector<double>;

constexpr std::size_t kLeastSamples = 50;
constexpr std::size_t kBandCount = Grid::kBands.size();
constexpr std::size_t kLongestDelay = Grid::kDelays.back();
constexpr double kLeastMoved = 1e-3;  // power of a valve's response over that without a band

std::vector<ErrorModel> error_models(double period) {
  std::vector<ErrorModel> models;
  for (const double walk : Grid::kWalks) {
    for (const double colour : Grid::kColours) models.push_back({walk, colour});
  }
  if (period < 6.0) return models;
  const double turn = 2.0 * std::cos(2.0 * std::numbers::pi / period);
  for (const double walk : {0.06, 0.2, 0.85}) {
    for (const double colour : {0.0, 0.5, 0.8}) models.push_back({walk, colour, turn, true});
  }
  return models;
}

// The valve: its stem follows u at a distance of at most half of the band.
template <class N>
void pass_valve(const std::vector<float>& u, N band, double side, std::vector<N>& out) {
  const N half = band * every<N>(0.5);
  N stem = every<N>(static_cast<double>(u.front())) - every<N>(side) * half;
  out.resize(u.size());
  for (std::size_t k = 0; k < u.size(); ++k) {
    const N at = every<N>(static_cast<double>(u[k]));
    stem = stem < at - half ? at - half : stem;
    stem = stem > at + half ? at + half : stem;
    out[k] = stem;
  }
}

// One point of the grid, with the gain that fits best there.
struct GridPoint {
  double log_likelihood = kNone;
  double band = 0.0;  // of CO's movement
  double side = 1.0;
  double pole = 0.0;
  std::size_t delay = 1;
  std::size_t error = 0;  // index of the error model
  double gain = 0.0;
};

class Piece {
 public:
  Piece(std::span<const double> pv, std::span<const double> co, double period)
      : period_(period), models_(error_models(period)) {
    const numeric::Range range = numeric::range_of(co);
    movement_ = range.high - range.low;
    scale_ = numeric::deviation(pv);
    moves_ = movement_ > 0.0 && scale_ > 0.0 && pv.size() >= kLeastSamples;
    if (!moves_) return;
    u_ = scaled(co, range.low, movement_);
    y_ = scaled(pv, pv.front(), scale_);
    informative_ = informative_share(y_);
    whiten_pv();
    search();
  }

  BandEvidence evidence() const;

 private:
  void whiten_pv() {
    std::vector<float> white;
    for (const ErrorModel& model : models_) {
      whiten(y_, model, white);
      powers_.push_back(remove_mean(white));
      white_pv_.push_back(white);
    }
  }

  void search() {
    std::vector<Lanes> stem;
    for (std::size_t first = 0; first < kBandCount; first += kLanes) {
      Lanes band{};
      for (std::size_t i = 0; i < kLanes; ++i) {
        band[i] = static_cast<float>(Grid::kBands[first + i]);
      }
      for (const double side : {-1.0, 1.0}) {
        pass_valve(u_, band, side, stem);
        for (std::size_t i = 0; i < kLanes; ++i) {
          reverses_[i] = first + i < Grid::kFirst || reversals_of(stem, i) >= Grid::kLeastReversals;
        }
        for (const double pole : Grid::kPoles) sum_over_errors(stem, pole, first, side);
      }
    }
  }

  // Adds the likelihoods of four bands with one process, for all dead times and error models.
  void sum_over_errors(const std::vector<Lanes>& stem, double pole, std::size_t first,
                       double side) {
    pass_process(stem, pole, rest_of(stem, pole), response_);
    for (std::size_t e = 0; e < models_.size(); ++e) {
      whiten(response_, models_[e], white_);
      const std::vector<float>& pv = white_pv_[e];
      const std::size_t size = white_.size();
      // One pass over the samples that all dead times have.
      Lanes power{}, sum{};
      std::array<Lanes, Grid::kDelays.size()> products{};
      for (std::size_t k = 0; k + kLongestDelay < size; ++k) {
        power += white_[k] * white_[k];
        sum += white_[k];
        for (std::size_t d = 0; d < products.size(); ++d) {
          products[d] += white_[k] * every<Lanes>(static_cast<double>(pv[k + Grid::kDelays[d]]));
        }
      }
      if (first == 0 && side < 0.0) powers_without_.push_back(static_cast<double>(power[0]));
      const double without = powers_without_[reference(pole, e)];
      for (std::size_t d = 0; d < products.size(); ++d) {
        const std::size_t delay = Grid::kDelays[d];
        Lanes along = products[d], own = power, mean = sum;
        for (std::size_t k = size - kLongestDelay; k + delay < size; ++k) {
          along += white_[k] * every<Lanes>(static_cast<double>(pv[k + delay]));
          own += white_[k] * white_[k];
          mean += white_[k];
        }
        for (std::size_t i = 0; i < kLanes; ++i) {
          if (!reverses_[i]) continue;
          const double total = static_cast<double>(own[i]);
          const double about_mean =
              total - static_cast<double>(mean[i]) * static_cast<double>(mean[i]) / samples();
          if (about_mean < 1e-4 * total || about_mean < kLeastMoved * without) continue;
          const double gain = static_cast<double>(along[i]) / about_mean;
          const double left =
              std::max(powers_[e] - gain * static_cast<double>(along[i]), 1e-9 * powers_[e]);
          count({.log_likelihood = log_likelihood(left, e),
                 .band = Grid::kBands[first + i],
                 .side = side,
                 .pole = pole,
                 .delay = delay,
                 .error = e,
                 .gain = gain},
                first + i);
        }
      }
    }
  }

  void count(const GridPoint& point, std::size_t band) {
    sums_[band] = log_add(sums_[band], point.log_likelihood);
    if (point.log_likelihood > best_[band].log_likelihood) best_[band] = point;
  }

  std::size_t reference(double pole, std::size_t error) const {
    const auto at = std::find(Grid::kPoles.begin(), Grid::kPoles.end(), pole);
    return static_cast<std::size_t>(at - Grid::kPoles.begin()) * models_.size() + error;
  }
  double samples() const { return static_cast<double>(y_.size() - Grid::kSkipped); }
  double log_likelihood(double left, std::size_t error) const {
    return -0.5 * informative_ * samples() * std::log(left / samples()) -
           (models_[error].oscillates ? Grid::kResonance : 0.0);
  }
  BandProcess process_of(const GridPoint& point) const {
    const double gain = point.gain * scale_ / movement_;
    return {.gain = gain * (point.pole < 1.0 ? 1.0 : kIntegration),
            .pole = point.pole,
            .delay = point.delay};
  }
  // Returns the share of PV's variance that the point explains in free run, with the gain that fits
  // best: a slip moves PV farther than the band does.
  double explained(const GridPoint& point) const;

  double period_;
  std::vector<ErrorModel> models_;
  bool moves_ = false;
  double movement_ = 0.0;                     // of CO, CO units
  double scale_ = 1.0;                        // of PV, PV units
  double informative_ = 1.0;                  // share of the samples
  std::vector<float> u_;                      // CO, 0 to 1
  std::vector<float> y_;                      // PV, from its first sample, deviation 1
  std::vector<std::vector<float>> white_pv_;  // by error model
  Doubles powers_;                            // of these
  Doubles powers_without_;                    // of the whitened response without a band
  std::array<bool, kLanes> reverses_{};
  std::vector<Lanes> response_, white_;
  std::array<double, kBandCount> sums_ = [] {
    std::array<double, kBandCount> none{};
    none.fill(kNone);
    return none;
  }();
  std::array<GridPoint, kBandCount> best_{};
};

// Returns the sum of squares of x about its moving mean over `2 half + 1` samples.
double fast_power(const Doubles& x, std::size_t half) {
  Doubles sums(x.size() + 1, 0.0);
  for (std::size_t k = 0; k < x.size(); ++k) sums[k + 1] = sums[k] + x[k];
  double power = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::size_t from = k > half ? k - half : 0;
    const std::size_t to = std::min(x.size(), k + half + 1);
    const double off = x[k] - (sums[to] - sums[from]) / static_cast<double>(to - from);
    power += off * off;
  }
  return power;
}

double Piece::explained(const GridPoint& point) const {
  std::vector<float> stem, response;
  pass_valve(u_, static_cast<float>(point.band), point.side, stem);
  pass_process(stem, point.pole, rest_of(stem, point.pole), response);
  Doubles pv(y_.size()), moved(y_.size()), both(y_.size());
  for (std::size_t k = 0; k < y_.size(); ++k) {
    pv[k] = static_cast<double>(y_[k]);
    moved[k] = k < point.delay ? 0.0 : point.gain * static_cast<double>(response[k - point.delay]);
    both[k] = pv[k] + moved[k];
  }
  const auto half = static_cast<std::size_t>(std::max(3.0, 0.75 * period_));
  const double of_pv = fast_power(pv, half);
  const double of_moved = fast_power(moved, half);
  if (!(of_pv > 0.0) || !(of_moved > 0.0)) return 0.0;
  const double product = 0.5 * (fast_power(both, half) - of_pv - of_moved);
  return product > 0.0 ? product * product / (of_pv * of_moved) : 0.0;
}

BandEvidence Piece::evidence() const {
  BandEvidence found;
  if (!moves_ || sums_[0] == kNone) return found;
  // Mean likelihoods of healthy, possible and sticking bands.
  std::array<double, 3> sums{kNone, kNone, kNone};
  std::array<double, 3> counts{};
  for (std::size_t i = 0; i < kBandCount; ++i) {
    found.log_likelihood[i] = std::max(sums_[i] - sums_[0], -1e3);
    if (i < Grid::kFirst) continue;
    const double band = Grid::kBands[i];
    const std::size_t size = band <= Grid::kSmall ? 0 : band < Grid::kLarge ? 1 : 2;
    sums[size] = log_add(sums[size], found.log_likelihood[i]);
    counts[size] += 1.0;
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] -= std::log(counts[i]);
  const double healthy = log_add(0.0, sums[0]);
  found.log_odds = sums[2] - healthy;
  found.decided = found.log_odds > 0.0 ? 1.0 : std::exp(healthy - log_add(healthy, sums[1]));
  const auto best = static_cast<std::size_t>(
      std::max_element(sums_.begin() + Grid::kFirst, sums_.end()) - sums_.begin());
  const GridPoint& point = best_[best];
  if (point.log_likelihood == kNone) return found;
  double total = 0.0;
  double mean = 0.0;
  for (std::size_t i = Grid::kFirst; i < kBandCount; ++i) {
    const double weight = std::exp(sums_[i] - sums_[best]);
    total += weight;
    mean += weight * Grid::kBands[i];
  }
  double below = 0.0;
  found.low = found.high = Grid::kBands[Grid::kFirst];
  for (std::size_t i = Grid::kFirst; i < kBandCount; ++i) {
    below += std::exp(sums_[i] - sums_[best]) / total;
    if (below < 0.05) found.low = Grid::kBands[i + 1];
    if (below < 0.95 && i + 1 < kBandCount) found.high = Grid::kBands[i + 1];
  }
  found.share = mean / total;
  found.movement = movement_;
  found.band = found.share * movement_;
  found.low *= movement_;
  found.high *= movement_;
  found.process = process_of(point);
  found.without = process_of(best_[0]);
  found.error = models_[point.error];
  found.explained = explained(point);
  found.explained_without = explained(best_[0]);
  double without_co = kNone;
  for (std::size_t e = 0; e < models_.size(); ++e) {
    without_co = std::max(without_co, log_likelihood(powers_[e], e));
  }
  found.information = std::max(point.log_likelihood, best_[0].log_likelihood) - without_co;
  return found;
}

}  // namespace

namespace {

// Adds up the pieces of a record.
BandEvidence sum_pieces(std::span<const double> pv, std::span<const double> co, double period) {
  const std::vector<RecordPiece> pieces = pieces_of(pv.size());
  BandEvidence all;
  double sum = 0.0;
  double decided = 0.0;
  double information = 0.0;
  for (const auto [from, length] : pieces) {
    const BandEvidence one =
        Piece(pv.subspan(from, length), co.subspan(from, length), period).evidence();
    sum += one.decided * std::clamp(one.log_odds, Grid::kLeastNats, Grid::kMostNats);
    decided += one.decided;
    information += one.information;
    if (from == 0 || one.log_odds > all.log_odds) all = one;
  }
  const auto count = static_cast<double>(pieces.size());
  all.log_odds = sum / std::max(1.0, decided);
  all.information = information / (count * static_cast<double>(pieces.front().size));
  return all;
}

}  // namespace

BandEvidence find_band(std::span<const double> pv, std::span<const double> co, double period) {
  BandEvidence best;
  for (const std::size_t factor : Grid::kFactors) {
    if (factor > 1 && pv.size() < factor * Grid::kLeastBlocks) break;
    BandEvidence found = sum_pieces(block_means(pv, factor), block_means(co, factor),
                                    period / static_cast<double>(factor));
    found.factor = factor;
    found.information /= static_cast<double>(factor);
    if (factor == 1 || found.information > best.information) best = found;
  }
  return best;
}

}  // namespace loopwarden::estimator
