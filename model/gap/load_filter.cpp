// SPDX-License-Identifier: Apache-2.0
#include "model/gap/load_filter.hpp"

#include <array>
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

template <std::size_t N>
void LoadFilter::whiten_lanes(const std::vector<double>* in,
                              std::vector<double>* out) const noexcept {
  std::array<const double*, N> from{};
  std::array<double*, N> to{};
  for (std::size_t c = 0; c < N; ++c) {
    from[c] = in[c].data();
    to[c] = out[c].data();
  }
  std::array<double, N> load{};
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& s = steps_[i];
    for (std::size_t c = 0; c < N; ++c) {
      load[c] *= s.keep;
      const double innovation = from[c][s.sample] - load[c];
      to[c][i] = innovation * s.scale;
      load[c] += s.gain * innovation;
    }
  }
}

void LoadFilter::whiten(const std::vector<std::vector<double>>& in,
                        std::vector<std::vector<double>>& out) const {
  out.resize(in.size());
  for (auto& column : out) column.resize(steps_.size());
  std::size_t c = 0;
  for (; c + 4 <= in.size(); c += 4) whiten_lanes<4>(&in[c], &out[c]);
  switch (in.size() - c) {
    case 3: whiten_lanes<3>(&in[c], &out[c]); break;
    case 2: whiten_lanes<2>(&in[c], &out[c]); break;
    case 1: whiten_lanes<1>(&in[c], &out[c]); break;
    default: break;
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
