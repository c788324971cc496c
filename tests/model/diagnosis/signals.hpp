// SPDX-License-Identifier: Apache-2.0
// Signals of known shape, and a small closed loop, for the tests of the diagnosis.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/random.hpp"

namespace loopwarden::tests {

using diagnosis::Series;

inline Series made_of(std::size_t n, const std::function<double(double)>& f) {
  Series x(n);
  for (std::size_t k = 0; k < n; ++k) x[k] = f(static_cast<double>(k));
  return x;
}
inline double sine(double t) { return std::sin(2.0 * std::numbers::pi * t); }
inline double square(double t) { return t - std::floor(t) < 0.5 ? 1.0 : -1.0; }
inline double triangle(double t) {  // lags a square wave's integral by a quarter period at 0
  const double phase = t - std::floor(t);
  return phase < 0.5 ? 4.0 * phase - 1.0 : 3.0 - 4.0 * phase;
}
inline Series with_noise(Series x, double deviation, std::uint64_t seed) {
  numeric::Random random(seed);
  for (double& v : x) v += deviation * random.normal();
  return x;
}

// PI on a first-order process with dead time. `valve` turns CO into flow, `load(t)` adds to the
// flow.
struct SmallLoop {
  double gain = 0.5;           // of the controller
  double integral_time = 4.0;  // s
  double time_constant = 3.0;  // s
  std::size_t dead_samples = 2;
  double sample_time_s = 0.5;
  double noise = 0.02;
  std::uint64_t seed = 1;

  struct Run {
    Series pv, co;
  };
  Run run(std::size_t n, const std::function<double(double)>& valve,
          const std::function<double(double)>& load) const {
    numeric::Random random(seed);
    Run r;
    std::vector<double> line(dead_samples + 1, 0.0);
    double x = 0.0;
    double integral = 50.0;
    const double a = std::exp(-sample_time_s / time_constant);
    for (std::size_t k = 0; k < n + 200; ++k) {
      const double pv = x + noise * random.normal();
      integral -= gain * pv * sample_time_s / integral_time;
      const double co = std::clamp(integral - gain * pv, 0.0, 100.0);
      line[k % line.size()] = valve(co) - 50.0 + load(static_cast<double>(k) * sample_time_s);
      x = a * x + (1.0 - a) * line[(k + 1) % line.size()];
      if (k < 200) continue;
      r.pv.push_back(20.0 + pv);
      r.co.push_back(co);
    }
    return r;
  }
};

// A steady load that wanders a little. With it a limit cycle forgets its phase, as in any plant.
inline std::function<double(double)> wandering_load(double mean, double step = 0.1) {
  return [mean, step, wander = 0.0, random = numeric::Random(8)](double) mutable {
    return mean + (wander = 0.95 * wander + step * random.normal());
  };
}

constexpr double kCyclePeriod = 40.0;  // samples, of cycle()
inline Series cycle(double (*shape)(double), double shift = 0.0) {
  return made_of(800, [=](double k) { return shape(k / kCyclePeriod + shift); });
}

}  // namespace loopwarden::tests
