// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace loopwarden::hidden_cases {

// The generator's own random numbers: SplitMix64 (Steele, Lea, Flood 2014), so that a seed gives
// the same case with each standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits();
  // Returns a number in [0, 1).
  double uniform();
  double uniform(double low, double high);
  // Uniform in the logarithm; low > 0.
  double log_uniform(double low, double high);
  // Mean 0, variance 1 (Box and Muller 1958).
  double normal();
  bool chance(double probability);
  // Returns an index below count; count > 0.
  std::size_t index(std::size_t count);
  // Returns -1 or 1.
  double sign();

 private:
  std::uint64_t state_;
};

}  // namespace loopwarden::hidden_cases
