// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/play_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::array kPlayBands{0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.9};
constexpr std::size_t kPlayDeadTimes = 8;
constexpr std::array kPlayLags{0.0, 0.04};  // of the period

// Returns the best R^2 of PV on v after a dead time and a lag.
double best_r2(const Series& y, const Series& v, double period) {
  const auto longest = static_cast<std::size_t>(period / 4.0 + 0.5);
  const std::size_t step = std::max<std::size_t>(1, longest / kPlayDeadTimes);
  double best = 0.0;
  Series behind(v.size());
  for (const double lag : kPlayLags) {
    const double share = lag > 0.0 ? 1.0 - std::exp(-1.0 / (lag * period)) : 1.0;
    double x = v.front();
    std::transform(v.begin(), v.end(), behind.begin(),
                   [&](double u) { return x += share * (u - x); });
    for (std::size_t d = 0; d <= longest && d + 3 < y.size(); d += step) {
      const std::span<const double> later(y.data() + d, y.size() - d);
      const std::span<const double> earlier(behind.data(), behind.size() - d);
      const double r = numeric::correlation(later, earlier);
      best = std::max(best, r * r);
    }
  }
  return best;
}

}  // namespace

PlayFit fit_play(const TimeScales& pv, const TimeScales& co, double period) {
  PlayFit fit;
  Series bands;
  for (std::size_t i = 0; i < pv.size(); ++i) {
    const double range = numeric::quantile(co[i], 0.98) - numeric::quantile(co[i], 0.02);
    if (range <= 0.0) continue;
    const double straight = best_r2(pv[i], co[i], period);
    double best = 0.0;
    double band = 0.0;
    Series v(co[i].size());
    for (const double share : kPlayBands) {
      effects::Backlash play(share * range);
      play.reset(co[i].front());
      std::transform(co[i].begin(), co[i].end(), v.begin(), [&](double u) { return play.step(u); });
      const double r2 = best_r2(pv[i], v, period);
      if (r2 > best) {
        best = r2;
        band = share * range;
      }
    }
    fit.evidence += std::clamp(
        std::log((1.0 - straight + Limits::kUnexplained) / (1.0 - best + Limits::kUnexplained)),
        -1.5, 1.5);
    fit.linear_r2 += straight;
    fit.play_r2 += best;
    bands.push_back(band);
  }
  const auto count = static_cast<double>(pv.size());
  fit.evidence /= count;
  fit.linear_r2 /= count;
  fit.play_r2 /= count;
  fit.band = numeric::median(bands);
  return fit;
}

}  // namespace loopwarden::diagnosis
