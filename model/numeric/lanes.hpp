// SPDX-License-Identifier: Apache-2.0
// Several numbers in step, so that one equation serves a number and a row of them.
//
// An equation written for a type `N` that is double, float or Lanes uses + - * /, comparisons and
// `condition ? a : b`, which all three have (of Lanes, lane by lane), and what is below for the rest.
// What a comparison gives is combined by & and !.
//
// Lanes are g++'s and clang's vectors: SSE on x86-64, NEON on arm64. Each lane has the bits that float
// would have.
// What they can't do: branches (both sides are worked out; `any` tells whether one is needed at all).
#pragma once

#include <cmath>
#include <cstddef>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

namespace loopwarden::numeric {

inline constexpr std::size_t kLanes = 4;
using Lanes = float __attribute__((vector_size(16)));
using LaneMask = int __attribute__((vector_size(16)));

// The same number in every lane.
template <class N>
inline N every(double value) noexcept {
  return static_cast<N>(value);
}
template <>
inline Lanes every<Lanes>(double value) noexcept {
  const auto v = static_cast<float>(value);
  return Lanes{v, v, v, v};
}

inline bool any(bool holds) noexcept { return holds; }
inline bool any(LaneMask holds) noexcept {
#ifdef __SSE__
  return _mm_movemask_ps(reinterpret_cast<__m128>(holds)) != 0;
#else
  using Halves = long long __attribute__((vector_size(16)));
  const auto halves = reinterpret_cast<Halves>(holds);
  return (halves[0] | halves[1]) != 0;
#endif
}

// exp(x) where it is asked for; elsewhere anything.
inline double exponential(double x, bool) noexcept { return std::exp(x); }
inline float exponential(float x, bool) noexcept { return std::exp(x); }
inline Lanes exponential(Lanes x, LaneMask where) noexcept {
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (where[i] != 0) x[i] = std::exp(x[i]);
  }
  return x;
}

// -x where x is negative.
template <class N>
inline N magnitude(N x) noexcept {
  return x < -x ? -x : x;
}

// `x` within [low, high]; bounds that are not numbers do not bind.
template <class N>
inline N within(N x, N low, N high) noexcept {
  const N y = high < x ? high : x;
  return y < low ? low : y;
}

}  // namespace loopwarden::numeric
