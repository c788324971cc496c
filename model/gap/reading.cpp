// SPDX-License-Identifier: Apache-2.0
#include "model/gap/reading.hpp"

#include <algorithm>
#include <cmath>

#include "model/gap/constants.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::gap {
namespace {

// Samples at which PV changed: each the first at or after first + j interval, for whole j.
std::optional<HeldReading> beat_of(const std::vector<std::size_t>& changes) {
  std::vector<double> apart;
  for (std::size_t i = 1; i < changes.size(); ++i) {
    apart.push_back(static_cast<double>(changes[i] - changes[i - 1]));
  }
  const double usual = numeric::median(apart);
  if (usual < 2.0) return std::nullopt;
  // A renewal by the same value is no change: j goes on by more than one.
  std::vector<double> j{0.0};
  for (const double samples : apart) {
    j.push_back(j.back() + std::max(1.0, std::round(samples / usual)));
  }
  const auto n = static_cast<double>(changes.size());
  double sum_j = 0.0;
  double sum_k = 0.0;
  double sum_jj = 0.0;
  double sum_jk = 0.0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const auto k = static_cast<double>(changes[i]);
    sum_j += j[i];
    sum_k += k;
    sum_jj += j[i] * j[i];
    sum_jk += j[i] * k;
  }
  double interval = (n * sum_jk - sum_j * sum_k) / (n * sum_jj - sum_j * sum_j);
  const double whole = std::round(interval);
  const bool is_whole = std::abs(interval - whole) * j.back() < 1.0;
  if (is_whole) interval = whole;
  std::vector<double> late;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    late.push_back(static_cast<double>(changes[i]) - j[i] * interval);
  }
  const double middle = numeric::median(late);
  const auto off =
      std::count_if(late.begin(), late.end(), [&](double l) { return std::abs(l - middle) > 1.0; });
  if (static_cast<double>(off) > kOffBeat * n) return std::nullopt;
  double first = is_whole ? std::round(middle) : middle - 0.5;
  first -= interval * std::floor(first / interval);
  return HeldReading{interval, first, changes.size()};
}

std::optional<HeldReading> held_reading(const std::vector<double>& pv) {
  std::vector<std::size_t> changes;
  std::vector<double> moves;
  for (std::size_t k = 1; k < pv.size(); ++k) {
    if (!std::isfinite(pv[k]) || !std::isfinite(pv[k - 1]) || pv[k] == pv[k - 1]) continue;
    changes.push_back(k);
    moves.push_back(std::abs(pv[k] - pv[k - 1]));
  }
  if (changes.size() < kFewestRenewals) return std::nullopt;
  // Treads of equal height are rounding or a coarse valve.
  std::sort(moves.begin(), moves.end());
  const double least = moves.front();
  const auto equal =
      std::count_if(moves.begin(), moves.end(), [&](double move) { return move < 1.5 * least; });
  if (static_cast<double>(equal) > kEqualSteps * static_cast<double>(moves.size())) {
    return std::nullopt;
  }
  return beat_of(changes);
}

struct Stay {
  std::size_t samples = 0;
  std::size_t pairs = 0;  // of neighbours that are both there
  std::size_t visits = 0;
};

Stay stay_at(const std::vector<double>& pv, double value) {
  Stay stay;
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (pv[k] != value) continue;
    ++stay.samples;
    if (k > 0 && pv[k - 1] == value) {
      ++stay.pairs;
    } else {
      ++stay.visits;
    }
  }
  return stay;
}

// Share of the neighbours that are equal, but for those at the ends.
double equal_between(const std::vector<double>& pv, double low, double high) {
  double equal = 0.0;
  double pairs = 0.0;
  for (std::size_t k = 1; k < pv.size(); ++k) {
    if (!(pv[k - 1] > low && pv[k - 1] < high) || !std::isfinite(pv[k])) continue;
    pairs += 1.0;
    if (pv[k] == pv[k - 1]) equal += 1.0;
  }
  return pairs > 0.0 ? equal / pairs : 1.0;
}

bool is_end(const Stay& stay, double equal_elsewhere) {
  if (stay.pairs < kFewestAtEnd || stay.visits < 2) return false;
  const double stays = static_cast<double>(stay.pairs) / static_cast<double>(stay.samples);
  return stays > kStaysAtEnd && equal_elsewhere < kStaysElsewhere * stays;
}

// The sample after the spike that begins at `from`; `from` itself where none does.
std::size_t end_of_spike(const std::vector<double>& pv, std::size_t from, std::size_t longest) {
  const double before = pv[from - 1];
  const double near = kSpikeNear * std::abs(pv[from] - before);
  for (std::size_t k = from + 1; k < pv.size() && k - from <= longest; ++k) {
    if (std::abs(pv[k] - before) < near) return k;
    if (!(std::abs(pv[k] - pv[from]) < near)) break;
  }
  return from;
}

}  // namespace

Spikes find_spikes(const std::vector<double>& pv, double least, std::size_t longest) {
  Spikes out;
  out.at.assign(pv.size(), false);
  std::vector<double> sizes;
  std::size_t staying = 0;
  for (std::size_t k = 1; k < pv.size(); ++k) {
    const double jump = std::abs(pv[k] - pv[k - 1]);
    if (!(jump > least)) continue;
    const std::size_t end = end_of_spike(pv, k, longest);
    if (end == k) {
      ++staying;
      continue;
    }
    std::fill(out.at.begin() + static_cast<std::ptrdiff_t>(k),
              out.at.begin() + static_cast<std::ptrdiff_t>(end), true);
    out.samples += end - k;
    sizes.push_back(jump);
    k = end;
  }
  // A longer excursion has two such jumps.
  if (staying > 2 * sizes.size()) return {.at = std::vector<bool>(pv.size(), false)};
  out.count = sizes.size();
  if (!sizes.empty()) out.size = numeric::median(sizes);
  return out;
}

ReadingFinding examine_reading(const std::vector<double>& pv) {
  ReadingFinding out;
  out.measured.assign(pv.size(), true);
  if (!numeric::LoopRecord::has_value(pv)) return out;
  std::vector<double> told = pv;  // once for each renewal
  out.held = held_reading(pv);
  if (out.held) {
    told.clear();
    for (std::size_t k = 0; k < pv.size(); ++k) {
      const auto after = [&](double sample) {
        return std::floor((sample - out.held->first_sample) / out.held->interval_samples + 1e-9);
      };
      const auto now = static_cast<double>(k);
      const bool renewed = k == 0 || after(now) != after(now - 1.0);
      out.measured[k] = k > 0 && renewed;
      if (renewed) told.push_back(pv[k]);
    }
  }
  const auto [low, high] = numeric::range_of(pv);
  const Stay at_low = stay_at(told, low);
  const Stay at_high = stay_at(told, high);
  const double elsewhere = equal_between(told, low, high);
  if (low < high && is_end(at_low, elsewhere)) {
    out.low = low;
    out.at_low = at_low.samples;
  }
  if (low < high && is_end(at_high, elsewhere)) {
    out.high = high;
    out.at_high = at_high.samples;
  }
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (pv[k] == out.low || pv[k] == out.high) out.measured[k] = false;
  }
  return out;
}

}  // namespace loopwarden::gap
