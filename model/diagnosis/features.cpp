// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/features.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/diagnosis/correlation.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/diagnosis/waveform.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

// Returns how many times better the second shape fits, as a bounded logarithm.
double log_ratio(double first, double second) {
  return std::clamp(std::log((first + 0.005) / (second + 0.005)), -3.0, 3.0);
}

}  // namespace

Features find_features(const Prepared& p, const ValveEvidence& e) {
  const CrossCorrelation xc = cross_correlation(p.error, p.output, p.period);
  const ControllerFit controller = fit_controller(p.error, p.output, p.period);
  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(p.period / 16.0 + 0.5));
  const Series slope =
      central_difference(moving_mean(p.error, static_cast<std::size_t>(p.period / 20.0)), lag);
  const Waveform co = waveform(p.output, p.period);
  const Waveform pv = waveform(p.error, p.period);
  const Waveform steep = waveform(slope, p.period);
  const std::array measured{
      // oscillation and time scale
      std::log1p(p.pv_oscillation.regularity), std::log1p(p.co_oscillation.regularity),
      p.pv_oscillation.peak, p.co_oscillation.peak, std::log(p.period),
      // record
      p.fast_share, p.held_share, std::min(0.5, p.share_at_limit),
      // correlation and controller, of the same sign for both kinds of action
      xc.at_zero * controller.action, xc.odd_share, std::min(1.2, xc.strength),
      std::cos(xc.phase) * controller.action, std::sin(xc.phase) * controller.action, xc.coherence,
      controller.integral_share, controller.fit,
      // waveforms
      co.sine_error, log_ratio(co.sine_error, co.triangle_error), std::min(5.0, co.kurtosis),
      co.third_in_phase, co.second, co.repeats, pv.sine_error,
      log_ratio(pv.sine_error, pv.flat_error), log_ratio(pv.sine_error, pv.triangle_error),
      std::min(5.0, pv.kurtosis), pv.third_in_phase, pv.third_across, pv.second, pv.repeats,
      std::clamp(std::log(pv.area_ratio), -2.0, 2.0), log_ratio(steep.sine_error, steep.flat_error),
      std::min(5.0, steep.kurtosis), steep.third_in_phase,
      std::min(3.0, std::abs(numeric::skewness(p.error))),
      std::min(3.0, std::abs(numeric::skewness(slope))),
      // valve
      std::clamp(e.log_odds, Limits::kLeastNats, Limits::kMostNats), e.share,
      std::clamp(e.explained, -1.0, 1.0), e.standing, std::min(3.0, e.reversals.travel_scatter),
      std::min(3.0, e.reversals.cycle_scatter)};
  static_assert(std::tuple_size_v<decltype(measured)> == kFeatures);
  Features features{};
  std::transform(measured.begin(), measured.end(), features.begin(),
                 [](double value) { return std::isfinite(value) ? value : 0.0; });
  return features;
}

}  // namespace loopwarden::diagnosis
