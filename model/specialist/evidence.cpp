// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/evidence.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::specialist {
namespace {

constexpr double kLeast = 1e-9;  // of a mean square, (% of span)^2

double log_ratio(double a, double b) noexcept { return std::log((a + kLeast) / (b + kLeast)); }
double bounded(double x) noexcept { return std::isfinite(x) ? std::clamp(x, -8.0, 8.0) : 0.0; }

}  // namespace

Evidence evidence_of(const Findings& f) noexcept {
  Evidence e{};
  std::size_t next = 0;
  const auto put = [&](double value) {
    if (next < e.size()) e[next++] = bounded(value);
  };
  const double noise = f.noise * f.noise;
  const Fit& healthy = f.of(Explanation::healthy);
  for (const Fit& fit : f.fits) {
    put(log_ratio(fit.mse, noise));
    put(log_ratio(fit.innovation, noise));
  }
  for (std::size_t i = 1; i < kExplanations; ++i) {
    put(log_ratio(f.fits[i].mse, healthy.mse));
    put(log_ratio(f.fits[i].innovation, healthy.innovation));
  }
  constexpr std::array kFaults{Explanation::backlash, Explanation::stiction,
                               Explanation::hysteresis_width, Explanation::low_air_supply};
  for (std::size_t i = 0; i < kFaults.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      put(2.0 * log_ratio(f.of(kFaults[i]).mse, f.of(kFaults[k]).mse));
    }
    put(std::log(f.of(kFaults[i]).size + 0.1));
  }
  put(bounded(f.of(Explanation::hysteresis_offset).size / 2.0));
  put(4.0 * f.of(Explanation::stiction).shape);
  put(2.0 * f.of(Explanation::hysteresis_width).shape);
  put(std::log(f.of(Explanation::low_air_supply).shape));
  put(log_ratio(f.of(Explanation::low_air_supply).limit + 0.1, f.co_range + 0.1));
  for (const Explanation x : {Explanation::healthy, Explanation::other_process}) {
    put(f.of(x).gain_off);
    put(f.of(x).dead_time_off);
    put(f.of(x).lag_off);
  }
  put(std::log(f.co_range / f.noise));
  put(std::log(f.pv_range / f.noise));
  put(log_ratio(f.co_travel + 0.1, f.co_range + 0.1));
  put(std::log(f.co_fastest + 0.05));
  put(std::log1p(f.reversals));
  return e;
}

}  // namespace loopwarden::specialist
