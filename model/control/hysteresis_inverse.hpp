// SPDX-License-Identifier: Apache-2.0
// Inverts the hysteresis of a valve: CO is set to the value at which the valve gives what the
// controller requests (kind `hysteresis`).
//
//   with width:   u such that H(u) = v, by bisection with 40 halvings. u stays if H(u) = v already.
//                 H(u) = (1/n) sum p_i,  p_i = clamp(p_i before, u - r_i, u + r_i)
//                 r_i as in hysteresis_width.hpp, n = 12
//   with offset:  u = v - offset while v falls, otherwise v: the inverse of hysteresis_offset.hpp
//   v             request of the law, without reversals smaller than noise_band
//
//   u, v, p_i, r_i, width, offset  CO units     knee  see effects/hysteresis/hysteresis_width.hpp
//
// Limits: the parameters are given, not adapted; the source's controller adapts them. A width that
// is too large pushes the valve too far at each reversal. A knee near 1 makes u jump by the width,
// as backlash compensation does.
//
// Source: Tao and Kokotovic, IEEE Trans. Automatic Control 40 (1995) 200-212 (parametrised
// inverse); Hassani, Tjahjowidodo and Do (2014) for the operator.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "model/control/compensator_contract.hpp"
#include "model/control/reversals.hpp"

namespace loopwarden::control {

class HysteresisInverse {
 public:
  HysteresisInverse(const CompensatorSettings& settings, double) noexcept
      : offset_(settings.offset),
        noise_band_(settings.noise_band),
        reversals_(settings.noise_band) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kPlays; ++i) {
      const double place = 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(kPlays);
      halves_[i] = std::max(0.0, settings.knee + (1.0 - settings.knee) * place);
      sum += halves_[i];
    }
    for (double& half : halves_) {
      half *= sum > 0.0 ? 0.5 * settings.width * static_cast<double>(kPlays) / sum : 0.0;
      widest_ = std::max(widest_, half);
    }
  }

  void reset(double output) noexcept {
    reversals_.reset(output);
    plays_.fill(output);
    wanted_ = output;
    input_ = output;
  }

  Correction step(const CompensatorInputs& in) noexcept {
    if (!std::isfinite(in.output)) return {};
    const double falling = reversals_.step(in.output) < 0 ? offset_ : 0.0;
    if (widest_ <= 0.0) return {.added = -falling};
    wanted_ = std::clamp(wanted_, in.output - noise_band_, in.output + noise_band_);
    if (std::abs(wanted_ - output_at(input_)) > kExact) {
      double low = wanted_ - widest_;
      double high = wanted_ + widest_;
      for (int i = 0; i < kHalvings; ++i) {
        const double middle = (low + high) / 2.0;
        (output_at(middle) < wanted_ ? low : high) = middle;
      }
      input_ = (low + high) / 2.0;
      for (std::size_t i = 0; i < kPlays; ++i) {
        plays_[i] = std::clamp(plays_[i], input_ - halves_[i], input_ + halves_[i]);
      }
    }
    return {.added = input_ - wanted_ - falling};
  }

 private:
  static constexpr std::size_t kPlays = 12;
  static constexpr int kHalvings = 40;
  static constexpr double kExact = 1e-9;  // CO units

  double output_at(double u) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < kPlays; ++i) {
      sum += std::clamp(plays_[i], u - halves_[i], u + halves_[i]);
    }
    return sum / static_cast<double>(kPlays);
  }

  double offset_;      // CO units
  double noise_band_;  // CO units
  Reversals reversals_;
  std::array<double, kPlays> halves_{};  // r_i
  double widest_ = 0.0;                  // CO units
  std::array<double, kPlays> plays_{};   // p_i
  double wanted_ = 0.0;                  // v, CO units
  double input_ = 0.0;                   // u, CO units
};

}  // namespace loopwarden::control
