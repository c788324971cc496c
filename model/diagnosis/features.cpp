// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/features.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/diagnosis/correlation.hpp"
#include "model/diagnosis/dwell_asymmetry.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/diagnosis/waveform.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

// Returns how many times better the second shape fits, as a bounded logarithm.
double log_ratio(double first, double second) {
  return std::clamp(std::log((first + 0.005) / (second + 0.005)), -3.0, 3.0);
}

double explained_more(double with, double without) {
  return std::clamp(std::log((1.0 - without + 0.01) / (1.0 - with + 0.01)), -1.0, 3.0);
}

}  // namespace

FeaturesAndFit find_features(const Prepared& p) {
  FeaturesAndFit found;
  const CrossCorrelation xc = cross_correlation(p.error, p.output, p.period);
  const ControllerFit controller = fit_controller(p.error, p.output, p.period);
  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(p.period / 16.0 + 0.5));
  const Series slope =
      central_difference(moving_mean(p.error, static_cast<std::size_t>(p.period / 20.0)), lag);
  const Waveform co = waveform(p.output, p.period);
  const Waveform pv = waveform(p.error, p.period);
  const Waveform steep = waveform(slope, p.period);
  const DwellAsymmetry d = find_dwell_asymmetry(p.output, p.error, p.period);
  const DwellAsymmetry by_slope = find_dwell_asymmetry(p.output, slope, p.period);
  found.fit = fit_valve(p, controller.action);
  const ValveFit& f = found.fit;
  const double valve_free = std::max(f.backlash.free, f.stiction.free);
  const double valve_whitened = std::max(f.backlash.whitened, f.stiction.whitened);
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
      // dwelling
      d.output_concentration, d.behind_concentration,
      log_ratio(d.behind_concentration, d.output_concentration), d.late, d.sticky_words,
      d.sticky_pairs, std::min(4.0, d.heavy_tails), std::min(4.0, d.output_tails),
      std::clamp(d.heavy_tails - d.output_tails, -3.0, 3.0),
      std::clamp(d.loop_area * controller.action, -1.5, 1.5), d.travel_scatter, d.duration_scatter,
      by_slope.behind_concentration, by_slope.sticky_words, std::min(4.0, by_slope.heavy_tails),
      std::min(3.0, std::abs(numeric::skewness(p.error))),
      std::min(3.0, std::abs(numeric::skewness(slope))),
      // fits
      f.linear.free, f.backlash.free, f.stiction.free, explained_more(valve_free, f.linear.free),
      f.linear.whitened, valve_whitened, explained_more(valve_whitened, f.linear.whitened),
      explained_more(f.stiction.free, f.backlash.free),
      explained_more(f.stiction.whitened, f.backlash.whitened),
      std::clamp(f.integrating_gain, -1.0, 1.0), f.dead_time, f.s > 0.0 ? f.band_share : 0.0,
      f.s > 0.0 ? f.j / f.s : 0.0, f.pole_share};
  static_assert(std::tuple_size_v<decltype(measured)> == kFeatures);
  std::transform(measured.begin(), measured.end(), found.features.begin(),
                 [](double value) { return std::isfinite(value) ? value : 0.0; });
  return found;
}

}  // namespace loopwarden::diagnosis
