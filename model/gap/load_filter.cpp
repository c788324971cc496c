// SPDX-License-Identifier: Apache-2.0
#include "model/gap/load_filter.hpp"

#include <cmath>

namespace loopwarden::gap {

LoadFilter::LoadFilter(const std::vector<bool>& used, double period_s, double load_ratio)
    : load_ratio_(load_ratio) {
  const double keep = std::exp(-period_s / kReturnTime_s);
  const double stationary = load_ratio * load_ratio * kReturnTime_s / (2.0 * period_s);
  const double kick = stationary * (1.0 - keep * keep);
  double variance = stationary;
  double keep_since = 1.0;
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (used[k]) {
      const double innovation = variance + 1.0;
      const double gain = variance / innovation;
      steps_.push_back({k, keep_since, gain, 1.0 / std::sqrt(innovation)});
      log_determinant_ += std::log(innovation);
      variance *= 1.0 - gain;
      keep_since = 1.0;
    }
    variance = keep * keep * variance + kick;
    keep_since *= keep;
  }
}

void LoadFilter::whiten(std::span<const double> in, std::span<double> out) const noexcept {
  double load = 0.0;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& s = steps_[i];
    load *= s.keep;
    const double innovation = in[s.sample] - load;
    out[i] = innovation * s.scale;
    load += s.gain * innovation;
  }
}

}  // namespace loopwarden::gap
