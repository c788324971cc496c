// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/blocks.hpp"

#include <algorithm>
#include <cmath>

#include "model/estimator/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {

Blocks::Blocks(const Observed& observed, std::size_t samples, std::size_t per_block,
               double noise_rms)
    : period_s_(observed.period_s),
      samples_(samples / per_block * per_block),
      per_block_(per_block),
      weight_(samples_, 0.0),
      pv_(samples_ / per_block, 0.0),
      noise_(samples_ / per_block, 0.0) {
  for (std::size_t b = 0; b < pv_.size(); ++b) {
    const std::size_t begin = b * per_block;
    double used = 0.0;
    for (std::size_t k = begin; k < begin + per_block; ++k) used += observed.used[k] ? 1.0 : 0.0;
    if (used == 0.0) continue;
    for (std::size_t k = begin; k < begin + per_block; ++k) {
      if (observed.used[k]) weight_[k] = 1.0 / used;
    }
    noise_[b] = noise_rms * noise_rms / used;
  }
  average(observed.pv, pv_);
}

void Blocks::average(std::span<const double> signal, std::span<double> means) const noexcept {
  const double* weight = weight_.data();
  const double* value = signal.data();
  for (std::size_t b = 0; b < pv_.size(); ++b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < per_block_; ++i) sum += *weight++ * *value++;
    means[b] = sum;
  }
}

Observed joined(const Observed& record, const Observed& test, double rest_s) {
  Observed out = record;
  const auto rest = static_cast<std::size_t>(std::ceil(rest_s / record.period_s));
  const auto between = [&](double from, double to, std::size_t k) {
    return from + (to - from) * static_cast<double>(k + 1) / static_cast<double>(rest + 1);
  };
  for (std::size_t k = 0; k < rest; ++k) {
    out.co.push_back(between(record.co.back(), test.co.front(), k));
    out.pv.push_back(between(record.pv.back(), test.pv.front(), k));
    out.used.push_back(false);
  }
  out.co.insert(out.co.end(), test.co.begin(), test.co.end());
  out.pv.insert(out.pv.end(), test.pv.begin(), test.pv.end());
  out.used.insert(out.used.end(), test.used.begin(), test.used.end());
  return out;
}

Observed without_spikes(Observed observed, double least, std::size_t longest) {
  const std::vector<double>& pv = observed.pv;
  double before = pv[0];  // last sample that counts
  for (std::size_t k = 1; k < pv.size(); ++k) {
    if (!observed.used[k]) continue;
    const double jump = pv[k] - before;
    if (std::abs(jump) > least) {
      const std::size_t last = std::min(pv.size() - 1, k + longest);
      std::size_t end = k + 1;
      while (end <= last &&
             (!observed.used[end] || std::abs(pv[end] - before) > 0.5 * std::abs(jump))) {
        ++end;
      }
      if (end <= last) {
        for (std::size_t i = k; i < end; ++i) observed.used[i] = false;
        k = end;
      }
    }
    before = pv[k];
  }
  return observed;
}

std::size_t block_length(double time_constant_s, double period_s, std::size_t samples) {
  const double wanted = kLimits.block_share * time_constant_s / period_s;
  const std::size_t most = std::max<std::size_t>(1, samples / kLimits.fewest_blocks);
  const std::size_t least = (samples + kLimits.most_blocks - 1) / kLimits.most_blocks;
  const auto length = static_cast<std::size_t>(std::clamp(std::floor(wanted + 0.5), 1.0, 1e6));
  return std::max(std::min(length, most), least);
}

double noise_of(const Observed& observed, std::size_t samples, double resolution, double span) {
  std::vector<double> curvature;
  for (std::size_t k = 1; k + 1 < samples; ++k) {
    if (!observed.used[k - 1] || !observed.used[k] || !observed.used[k + 1]) continue;
    curvature.push_back(std::abs(observed.pv[k + 1] - 2.0 * observed.pv[k] + observed.pv[k - 1]));
  }
  const double measured = numeric::kNormalOverMad * numeric::median(curvature) / std::sqrt(6.0);
  return std::max({measured, resolution / std::sqrt(12.0), kLimits.least_noise * span});
}

}  // namespace loopwarden::estimator
