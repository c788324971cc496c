// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/random.hpp"

#include <cmath>
#include <numbers>

namespace loopwarden::hidden_cases {

std::uint64_t Random::bits() {
  state_ += 0x9E3779B97F4A7C15U;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31U);
}

double Random::uniform() { return static_cast<double>(bits() >> 11U) * 0x1.0p-53; }

double Random::uniform(double low, double high) { return low + (high - low) * uniform(); }

double Random::log_uniform(double low, double high) {
  return low * std::exp(uniform() * std::log(high / low));
}

double Random::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

bool Random::chance(double probability) { return uniform() < probability; }

std::size_t Random::index(std::size_t count) { return static_cast<std::size_t>(bits() % count); }

double Random::sign() { return chance(0.5) ? 1.0 : -1.0; }

}  // namespace loopwarden::hidden_cases
