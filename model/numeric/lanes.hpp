// SPDX-License-Identifier: Apache-2.0
// Four floats that are computed together, so that one equation serves both a number and four
// numbers.
//
// An equation for a type `N` (double, float or Lanes) uses + - * /, comparisons and `condition ? a
// : b`, which Lanes apply lane by lane, and the functions below. Results of comparisons are
// combined with & and !.
//
// Lanes are vectors of g++ and clang: SSE on x86-64, NEON on arm64. Each lane has the same bits as
// float.
// Limits: no branches. Both sides of a condition are computed; `any` reports whether a side is
// needed.
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

// Returns `value` in every lane.
template <class N>
inline N every(double value) noexcept {
  return static_cast<N>(value);
}
template <>
inline Lanes every<Lanes>(double value) noexcept {
  const auto v = static_cast<float>(value);
  return Lanes{v, v, v, v};
}

// Returns whether the condition holds in at least one lane.
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

// Returns exp(x) in the lanes that `where` selects; the other lanes have no defined value.
inline double exponential(double x, bool) noexcept { return std::exp(x); }
inline float exponential(float x, bool) noexcept { return std::exp(x); }
inline Lanes exponential(Lanes x, LaneMask where) noexcept {
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (where[i] != 0) x[i] = std::exp(x[i]);
  }
  return x;
}

// Returns |x|.
template <class N>
inline N magnitude(N x) noexcept {
  return x < -x ? -x : x;
}

// Returns `x` clamped to [low, high]; a bound that is not a number is ignored.
template <class N>
inline N within(N x, N low, N high) noexcept {
  const N y = high < x ? high : x;
  return y < low ? low : y;
}

}  // namespace loopwarden::numeric
