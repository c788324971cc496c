// SPDX-License-Identifier: Apache-2.0
#include "model/gap/load_filter.hpp"

#include <array>
#include <cmath>

namespace loopwarden::gap {

LoadFilter::LoadFilter(const std::vector<bool>& used, double period_s, double load_ratio,
                       Valve valve)
    : load_ratio_(load_ratio), valve_ratio_(valve.ratio) {
  const double keep = std::exp(-period_s / kReturnTime_s);
  const double keep_valve = std::exp(-period_s / valve.forgets_s);
  const double stationary = load_ratio * load_ratio * kReturnTime_s / (2.0 * period_s);
  const double stationary_valve = valve.ratio * valve.ratio;
  const double kick = stationary * (1.0 - keep * keep);
  const double kick_valve = stationary_valve * (1.0 - keep_valve * keep_valve);
  // Covariance of the two.
  double load = stationary;
  double both = 0.0;
  double left = stationary_valve;
  double keep_since = 1.0;
  double keep_valve_since = 1.0;
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (used[k]) {
      const double innovation = load + 2.0 * both + left + 1.0;
      const double gain = (load + both) / innovation;
      const double gain_valve = (both + left) / innovation;
      steps_.push_back(
          {k, keep_since, keep_valve_since, gain, gain_valve, 1.0 / std::sqrt(innovation)});
      log_determinant_ += std::log(innovation);
      load -= gain * gain * innovation;
      both -= gain * gain_valve * innovation;
      left -= gain_valve * gain_valve * innovation;
      keep_since = 1.0;
      keep_valve_since = 1.0;
    }
    load = keep * keep * load + kick;
    both *= keep * keep_valve;
    left = keep_valve * keep_valve * left + kick_valve;
    keep_since *= keep;
    keep_valve_since *= keep_valve;
  }
}

template <std::size_t N, bool with_valve>
void LoadFilter::whiten_lanes(const std::vector<double>* in,
                              std::vector<double>* out) const noexcept {
  std::array<const double*, N> from{};
  std::array<double*, N> to{};
  for (std::size_t c = 0; c < N; ++c) {
    from[c] = in[c].data();
    to[c] = out[c].data();
  }
  std::array<double, N> load{};
  std::array<double, N> left{};
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& s = steps_[i];
    for (std::size_t c = 0; c < N; ++c) {
      load[c] *= s.keep;
      double innovation = from[c][s.sample] - load[c];
      if constexpr (with_valve) {
        left[c] *= s.keep_valve;
        innovation -= left[c];
        left[c] += s.gain_valve * innovation;
      }
      to[c][i] = innovation * s.scale;
      load[c] += s.gain * innovation;
    }
  }
}

template <bool with_valve>
void LoadFilter::whiten_columns(const std::vector<std::vector<double>>& in,
                                std::vector<std::vector<double>>& out) const {
  std::size_t c = 0;
  for (; c + 4 <= in.size(); c += 4) whiten_lanes<4, with_valve>(&in[c], &out[c]);
  switch (in.size() - c) {
    case 3: whiten_lanes<3, with_valve>(&in[c], &out[c]); break;
    case 2: whiten_lanes<2, with_valve>(&in[c], &out[c]); break;
    case 1: whiten_lanes<1, with_valve>(&in[c], &out[c]); break;
    default: break;
  }
}

void LoadFilter::whiten(const std::vector<std::vector<double>>& in,
                        std::vector<std::vector<double>>& out) const {
  out.resize(in.size());
  for (auto& column : out) column.resize(steps_.size());
  if (valve_ratio_ > 0.0) {
    whiten_columns<true>(in, out);
  } else {
    whiten_columns<false>(in, out);
  }
}

void LoadFilter::whiten(std::span<const double> in, std::span<double> out) const noexcept {
  double load = 0.0;
  double left = 0.0;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& s = steps_[i];
    load *= s.keep;
    left *= s.keep_valve;
    const double innovation = in[s.sample] - load - left;
    out[i] = innovation * s.scale;
    load += s.gain * innovation;
    left += s.gain_valve * innovation;
  }
}

}  // namespace loopwarden::gap
