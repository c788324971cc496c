// SPDX-License-Identifier: Apache-2.0
// Seeded random numbers that are the same on every machine and with every standard library. Only in
// the tails of the normal distribution can the last bit differ, as that of std::log does.
//
// std::normal_distribution leaves its algorithm to the library, so a record that was simulated on
// one system could not be repeated on another. That is the reason for this small generator.
//
// Uniform: xoshiro256++ (Blackman and Vigna, ACM Trans. Math. Softw. 47, 2021), seeded by
// splitmix64.
// Normal:  inverse of the normal distribution function by a rational approximation with a relative
//          error below 1.2e-9 (P. J. Acklam, 2003): fast, and one draw per number.
// Limits: not for cryptography; tails end at 8.2 standard deviations (52-bit uniforms).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace loopwarden::numeric {

class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept {
    for (auto& word : state_) {
      seed += 0x9e3779b97f4a7c15ULL;
      std::uint64_t z = seed;
      z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
      z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
      word = z ^ (z >> 31U);
    }
  }

  std::uint64_t bits() noexcept {
    const std::uint64_t result = rotate(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17U;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = rotate(state_[3], 45);
    return result;
  }

  // Returns a number in the open interval (0, 1): the middle of one of 2^52 equal parts, exact in a
  // double.
  double uniform() noexcept { return (static_cast<double>(bits() >> 12U) + 0.5) * 0x1.0p-52; }
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }

  // Returns a normal number with mean 0 and standard deviation 1.
  double normal() noexcept {
    const double p = uniform();
    const double q = p - 0.5;
    // clang-format off: the polynomials by Horner's scheme, one coefficient per step
    if (std::abs(q) <= kCentral) {
      const double r = q * q;
      return (((((-3.969683028665376e+01 * r + 2.209460984245205e+02) * r - 2.759285104469687e+02) *
                    r +
                1.383577518672690e+02) *
                   r -
               3.066479806614716e+01) *
                  r +
              2.506628277459239e+00) *
             q /
             (((((-5.447609879822406e+01 * r + 1.615858368580409e+02) * r - 1.556989798598866e+02) *
                    r +
                6.680131188771972e+01) *
                   r -
               1.328068155288572e+01) *
                  r +
              1.0);
    }
    const double r = std::sqrt(-2.0 * std::log(q < 0.0 ? p : 1.0 - p));
    const double tail =
        (((((-7.784894002430293e-03 * r - 3.223964580411365e-01) * r - 2.400758277161838e+00) * r -
           2.549732539343734e+00) *
              r +
          4.374664141464968e+00) *
             r +
         2.938163982698783e+00) /
        ((((7.784695709041462e-03 * r + 3.224671290700398e-01) * r + 2.445134137142996e+00) * r +
          3.754408661907416e+00) *
             r +
         1.0);
    // clang-format on
    return q < 0.0 ? tail : -tail;
  }

 private:
  static constexpr double kCentral = 0.47575;  // above: the approximation for the tails

  static std::uint64_t rotate(std::uint64_t x, unsigned k) noexcept {
    return (x << k) | (x >> (64U - k));
  }
  std::array<std::uint64_t, 4> state_;
};

// A generator with an eighth of the state and coarser numbers (24 bits), for searches that always
// restart from the same few numbers: 32-bit xorshift (Marsaglia, J. Statistical Software 8(14),
// 2003).
class ShortRandom {
 public:
  // Returns a number in [0, 1).
  double uniform() noexcept {
    bits_ ^= bits_ << 13U;
    bits_ ^= bits_ >> 17U;
    bits_ ^= bits_ << 5U;
    return static_cast<double>(bits_ >> 8U) * 0x1.0p-24;
  }
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }

 private:
  std::uint32_t bits_ = 0x9e3779b9U;
};

}  // namespace loopwarden::numeric
