// SPDX-License-Identifier: Apache-2.0
// Filters and sums of the likelihood of a band (docs/math/band.md), for one series or for four
// (N = Lanes). Used by band.cpp and slip_jump.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "model/estimator/band.hpp"
#include "model/numeric/lanes.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {

inline constexpr float kStraight = 1e-5F;     // deviations of PV
inline constexpr double kIntegration = 0.02;  // gain of the integrator per sample: floats near 1
inline constexpr double kNone = -std::numeric_limits<double>::infinity();

inline double log_add(double a, double b) {
  const double high = std::max(a, b);
  return high == kNone ? kNone : high + std::log1p(std::exp(std::min(a, b) - high));
}

inline std::vector<double> block_means(std::span<const double> x, std::size_t factor) {
  std::vector<double> means;
  for (std::size_t from = 0; from + factor <= x.size(); from += factor) {
    means.push_back(numeric::mean(x.subspan(from, factor)));
  }
  return means;
}

struct RecordPiece {
  std::size_t from;
  std::size_t size;
};

// Returns the pieces of a record of `samples` samples.
inline std::vector<RecordPiece> pieces_of(std::size_t samples) {
  const std::size_t count =
      std::clamp<std::size_t>(samples / BandGrid::kMostSamples, 1, BandGrid::kMostPieces);
  if (count == 1) return {{0, samples}};
  std::vector<RecordPiece> pieces;
  for (std::size_t i = 0; i < count; ++i) {
    pieces.push_back(
        {i * (samples - BandGrid::kMostSamples) / (count - 1), BandGrid::kMostSamples});
  }
  return pieces;
}

inline std::vector<float> scaled(std::span<const double> x, double zero, double unit) {
  std::vector<float> out;
  for (const double value : x) out.push_back(static_cast<float>((value - zero) / unit));
  return out;
}

// Returns the share of the samples at which PV leaves the straight line through the two before:
// between two values that an archive stored, PV is a straight line and carries no information.
inline double informative_share(const std::vector<float>& pv) {
  std::size_t count = 0;
  for (std::size_t k = 2; k < pv.size(); ++k) {
    count += std::abs(pv[k] - 2.0F * pv[k - 1] + pv[k - 2]) > kStraight ? 1U : 0U;
  }
  return static_cast<double>(count) / static_cast<double>(pv.size() - 2);
}

template <class N>
void whiten(const std::vector<N>& x, const ErrorModel& model, std::vector<N>& out) {
  using numeric::every;
  const N keeps = every<N>(1.0 - model.walk);
  const N colour = every<N>(model.colour);
  const N zero = every<N>(0.0);
  N last = x.front();
  N before = zero;  // difference without the walk's own past
  out.resize(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const N now = x[k] - last + keeps * before;
    out[k] = now - colour * before;
    last = x[k];
    before = now;
  }
  if (!model.oscillates) return;
  const double zeros = BandGrid::kRadius * BandGrid::kDamping;
  const N a1 = every<N>(BandGrid::kRadius * model.turn);
  const N a2 = every<N>(BandGrid::kRadius * BandGrid::kRadius);
  const N b1 = every<N>(zeros * model.turn);
  const N b2 = every<N>(zeros * zeros);
  N in1 = zero, in2 = zero, out1 = zero, out2 = zero;
  for (N& value : out) {
    const N filtered = value - a1 * in1 + a2 * in2 + b1 * out1 - b2 * out2;
    in2 = in1;
    in1 = value;
    out2 = out1;
    value = out1 = filtered;
  }
}

// Removes the mean of the whitened PV, which is the drift of the disturbance, and its first
// samples. Returns the power that remains.
inline double remove_mean(std::vector<float>& white) {
  std::fill_n(white.begin(), BandGrid::kSkipped, 0.0F);
  double sum = 0.0;
  for (const float value : white) sum += static_cast<double>(value);
  const double mean = sum / static_cast<double>(white.size() - BandGrid::kSkipped);
  double power = 0.0;
  for (std::size_t k = BandGrid::kSkipped; k < white.size(); ++k) {
    white[k] -= static_cast<float>(mean);
    power += static_cast<double>(white[k]) * static_cast<double>(white[k]);
  }
  return power;
}

// The response of the process of gain 1; `rest` is the input at which it rests.
template <class N>
void pass_process(const std::vector<N>& v, double pole, N rest, std::vector<N>& out) {
  using numeric::every;
  const N keeps = every<N>(pole);
  const N gain = every<N>(pole < 1.0 ? 1.0 - pole : kIntegration);
  N state = every<N>(0.0);
  out.resize(v.size());
  for (std::size_t k = 0; k < v.size(); ++k) {
    out[k] = state = keeps * state + gain * (v[k] - rest);
  }
}

template <class N>
N rest_of(const std::vector<N>& v, double pole) {
  if (pole < 1.0) return v.front();
  N sum = numeric::every<N>(0.0);
  for (const N value : v) sum += value;
  return sum * numeric::every<N>(1.0 / static_cast<double>(v.size()));
}

inline std::size_t reversals_of(const std::vector<numeric::Lanes>& stem, std::size_t lane) {
  std::size_t count = 0;
  float direction = 0.0F;
  for (std::size_t k = 1; k < stem.size(); ++k) {
    const float change = stem[k][lane] - stem[k - 1][lane];
    if (change == 0.0F) continue;
    if (change * direction < 0.0F) ++count;
    direction = change;
  }
  return count;
}

}  // namespace loopwarden::estimator
