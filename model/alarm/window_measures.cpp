// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/window_measures.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/alarm/limits.hpp"
#include "model/analysis/loop_metrics.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/oscillation.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::alarm {
namespace {

// Returns CO's travel from each of its turning points to the move of the stem that answers it.
std::vector<double> stick_travels(const Window& window, double resolution) {
  std::vector<double> travels;
  double rest = window.stem.front();
  int direction = 0;  // of the last move
  double highest = window.co.front();
  double lowest = window.co.front();
  for (std::size_t k = 0; k < window.stem.size(); ++k) {
    highest = std::max(highest, window.co[k]);
    lowest = std::min(lowest, window.co[k]);
    const double move = window.stem[k] - rest;
    if (!(std::abs(move) > resolution)) continue;
    const int now = move > 0.0 ? 1 : -1;
    if (direction != 0 && now != direction) {
      travels.push_back(now > 0 ? window.co[k] - lowest : highest - window.co[k]);
    }
    direction = now;
    rest = window.stem[k];
    highest = lowest = window.co[k];
  }
  return travels;
}

void measure_stick(const Window& window, double resolution, bool has_stem, WindowMeasures& m) {
  const double span = window.co_high - window.co_low;
  if (has_stem) {
    std::vector<double> travels = stick_travels(window, resolution);
    if (travels.empty()) return;
    // A move is detected after it exceeds the resolution, so CO has moved on by as much.
    m.stick_percent =
        100.0 * std::max(numeric::quantile_in_place(travels, 0.5) - resolution, 0.0) / span;
    m.stick_source = StickSource::read_back;
    return;
  }
  if (m.oscillation_index <= diagnosis::DiagnosisLimits::kRegular) return;
  const double rho = numeric::correlation(window.co, window.pv);
  const double width = 2.0 * std::sqrt(2.0 * numeric::variance(window.co)) *
                       std::sqrt(std::max(1.0 - rho * rho, 0.0));
  m.stick_percent = 100.0 * width / span;
  m.stick_source = StickSource::ellipse;
}

}  // namespace

WindowMeasures measure(const Window& window) {
  WindowMeasures m;
  m.bridged_cycles = window.bridged_cycles;
  const double co_span = window.co_high - window.co_low;
  const double pv_span = window.pv_high - window.pv_low;
  if (window.pv.size() < 2 || !(co_span > 0.0) || !(pv_span > 0.0)) return m;
  const double resolution = Limits::kResolution_percent / 100.0 * co_span;
  const bool has_stem = std::all_of(window.stem.begin(), window.stem.end(),
                                    [](double v) { return std::isfinite(v); });

  const analysis::LoopMetrics metrics = analysis::loop_metrics(
      window.sp, window.pv, has_stem ? window.stem : window.co, window.period_s, resolution);
  m.mean_error_percent = 100.0 * metrics.mean_error / pv_span;
  m.variability_percent =
      100.0 *
      std::sqrt(std::max(
          metrics.rms_error * metrics.rms_error - metrics.mean_error * metrics.mean_error, 0.0)) /
      pv_span;
  m.travel_percent_per_hour = 100.0 * metrics.travel_per_hour / co_span;
  m.reversals_per_hour = metrics.reversals_per_hour;

  const auto [lowest, highest] = std::minmax_element(window.sp.begin(), window.sp.end());
  m.set_point_range_percent = 100.0 * (*highest - *lowest) / pv_span;

  const double margin = 1e-6 * co_span;
  const auto at_end = std::count_if(window.co.begin(), window.co.end(), [&](double co) {
    return co <= window.co_low + margin || co >= window.co_high - margin;
  });
  m.saturated_percent = 100.0 * static_cast<double>(at_end) / static_cast<double>(window.co.size());

  const diagnosis::Oscillation oscillation = diagnosis::find_oscillation(window.pv);
  m.oscillation_index = oscillation.regularity;
  if (oscillation.regularity > diagnosis::DiagnosisLimits::kRegular)
    m.period_s = oscillation.period * window.period_s;
  measure_stick(window, resolution, has_stem, m);
  return m;
}

}  // namespace loopwarden::alarm
