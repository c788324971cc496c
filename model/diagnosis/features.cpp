// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/features.hpp"

#include <algorithm>
#include <cmath>

#include "model/diagnosis/correlation.hpp"
#include "model/diagnosis/dwell.hpp"
#include "model/diagnosis/series.hpp"
#include "model/diagnosis/waveform.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

// How many times better the second shape fits, as a bounded logarithm.
double log_ratio(double first, double second) {
  return std::clamp(std::log((first + 0.005) / (second + 0.005)), -3.0, 3.0);
}

double explained_more(double with, double without) {
  return std::clamp(std::log((1.0 - without + 0.01) / (1.0 - with + 0.01)), -1.0, 3.0);
}

}  // namespace

FeaturesAndFit find_features(const Prepared& p) {
  FeaturesAndFit found;
  const auto set = [&](std::size_t index, double value) {
    found.features[index] = std::isfinite(value) ? value : 0.0;
  };
  set(feature_index("pv_regularity"), std::log1p(p.pv_oscillation.regularity));
  set(feature_index("co_regularity"), std::log1p(p.co_oscillation.regularity));
  set(feature_index("pv_peak"), p.pv_oscillation.peak);
  set(feature_index("co_peak"), p.co_oscillation.peak);
  set(feature_index("log_samples_per_period"), std::log(p.period));
  set(feature_index("noise_share"), p.fast_share);
  set(feature_index("held_share"), p.held_share);
  set(feature_index("share_at_limit"), std::min(0.5, p.share_at_limit));

  const CrossCorrelation xc = cross_correlation(p.error, p.output, p.period);
  const ControllerFit controller = fit_controller(p.error, p.output, p.period);
  // The same sign for both kinds of action.
  set(feature_index("xc_at_zero"), xc.at_zero * controller.action);
  set(feature_index("xc_odd_share"), xc.odd_share);
  set(feature_index("xc_strength"), std::min(1.2, xc.strength));
  set(feature_index("phase_cos"), std::cos(xc.phase) * controller.action);
  set(feature_index("phase_sin"), std::sin(xc.phase) * controller.action);
  set(feature_index("coherence"), xc.coherence);
  set(feature_index("integral_share"), controller.integral_share);
  set(feature_index("controller_fit"), controller.fit);

  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(p.period / 16.0 + 0.5));
  const Series slope =
      central_difference(moving_mean(p.error, static_cast<std::size_t>(p.period / 20.0)), lag);
  const Waveform co = waveform(p.output, p.period);
  const Waveform pv = waveform(p.error, p.period);
  const Waveform steep = waveform(slope, p.period);
  set(feature_index("co_sine_error"), co.sine_error);
  set(feature_index("co_sine_over_triangle"), log_ratio(co.sine_error, co.triangle_error));
  set(feature_index("co_kurtosis"), std::min(5.0, co.kurtosis));
  set(feature_index("co_third"), co.third_in_phase);
  set(feature_index("co_second"), co.second);
  set(feature_index("co_repeats"), co.repeats);
  set(feature_index("pv_sine_error"), pv.sine_error);
  set(feature_index("pv_sine_over_flat"), log_ratio(pv.sine_error, pv.flat_error));
  set(feature_index("pv_sine_over_triangle"), log_ratio(pv.sine_error, pv.triangle_error));
  set(feature_index("pv_kurtosis"), std::min(5.0, pv.kurtosis));
  set(feature_index("pv_third"), pv.third_in_phase);
  set(feature_index("pv_third_across"), pv.third_across);
  set(feature_index("pv_second"), pv.second);
  set(feature_index("pv_repeats"), pv.repeats);
  set(feature_index("pv_area"), std::clamp(std::log(pv.area_ratio), -2.0, 2.0));
  set(feature_index("slope_sine_over_flat"), log_ratio(steep.sine_error, steep.flat_error));
  set(feature_index("slope_kurtosis"), std::min(5.0, steep.kurtosis));
  set(feature_index("slope_third"), steep.third_in_phase);

  const Dwell d = dwell(p.output, p.error, p.period);
  const Dwell by_slope = dwell(p.output, slope, p.period);
  set(feature_index("co_concentration"), d.output_concentration);
  set(feature_index("pv_concentration"), d.behind_concentration);
  set(feature_index("pv_over_co_concentration"),
      log_ratio(d.behind_concentration, d.output_concentration));
  set(feature_index("pv_late"), d.late);
  set(feature_index("pv_sticky_words"), d.sticky_words);
  set(feature_index("pv_sticky_pairs"), d.sticky_pairs);
  set(feature_index("pv_tails"), std::min(4.0, d.heavy_tails));
  set(feature_index("co_tails"), std::min(4.0, d.output_tails));
  set(feature_index("tails_difference"), std::clamp(d.heavy_tails - d.output_tails, -3.0, 3.0));
  set(feature_index("co_travel_scatter"), d.travel_scatter);
  set(feature_index("co_duration_scatter"), d.duration_scatter);
  set(feature_index("loop_area"), std::clamp(d.loop_area * controller.action, -1.5, 1.5));
  set(feature_index("slope_concentration"), by_slope.behind_concentration);
  set(feature_index("slope_sticky_words"), by_slope.sticky_words);
  set(feature_index("slope_tails"), std::min(4.0, by_slope.heavy_tails));
  set(feature_index("pv_skewness"), std::min(3.0, std::abs(numeric::skewness(p.error))));
  set(feature_index("pv_step_skewness"), std::min(3.0, std::abs(numeric::skewness(slope))));

  found.fit = fit_valve(p, controller.action);
  const ValveFit& f = found.fit;
  const double valve_free = std::max(f.backlash.free, f.stiction.free);
  const double valve_whitened = std::max(f.backlash.whitened, f.stiction.whitened);
  set(feature_index("linear_free"), f.linear.free);
  set(feature_index("backlash_free"), f.backlash.free);
  set(feature_index("stiction_free"), f.stiction.free);
  set(feature_index("stiction_gain_free"), explained_more(valve_free, f.linear.free));
  set(feature_index("linear_whitened"), f.linear.whitened);
  set(feature_index("stiction_whitened"), valve_whitened);
  set(feature_index("stiction_gain_whitened"), explained_more(valve_whitened, f.linear.whitened));
  set(feature_index("jump_gain_free"), explained_more(f.stiction.free, f.backlash.free));
  set(feature_index("jump_gain_whitened"),
      explained_more(f.stiction.whitened, f.backlash.whitened));
  set(feature_index("integrating"), std::clamp(f.integrating_gain, -1.0, 1.0));
  set(feature_index("fit_dead_time"), f.dead_time);
  set(feature_index("fit_band"), f.s > 0.0 ? f.band_share : 0.0);
  set(feature_index("fit_jump"), f.s > 0.0 ? f.j / f.s : 0.0);
  set(feature_index("fit_time_constant"), f.pole_share);
  return found;
}

}  // namespace loopwarden::diagnosis
