// SPDX-License-Identifier: Apache-2.0
// Oscillation, waveform and correlation on signals of known shape.
#include <catch2/catch.hpp>

#include "model/diagnosis/correlation.hpp"
#include "model/diagnosis/oscillation.hpp"
#include "model/diagnosis/waveform.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::shapes_test {
namespace {

using namespace diagnosis;

TEST_CASE("an oscillation in noise is found with its period, noise gives no oscillation") {
  const Series cycling = with_noise(cycle(sine), 0.7, 3);
  const Oscillation found = find_oscillation(cycling);
  CHECK(found.period == Approx(kCyclePeriod).epsilon(0.02));
  CHECK(found.regularity > 3.0);
  CHECK(found.peak > 0.4);
  const Oscillation none = find_oscillation(with_noise(Series(800, 0.0), 1.0, 4));
  CHECK(none.peak < 0.3);
}

TEST_CASE("the time scale is that of the cycle, not of the drift below it") {
  Series drifting = cycle(sine);
  for (std::size_t k = 0; k < drifting.size(); ++k) {
    drifting[k] += 3.0 * std::sin(static_cast<double>(k) / 160.0);
  }
  CHECK(find_time_scale(drifting).oscillation.period == Approx(kCyclePeriod).epsilon(0.05));
}

TEST_CASE("each shape is fitted best by itself, and has the harmonics of the books") {
  const Waveform of_sine = waveform(cycle(sine), kCyclePeriod);
  const Waveform of_triangle = waveform(cycle(triangle), kCyclePeriod);
  const Waveform of_square = waveform(cycle(square), kCyclePeriod);
  CHECK(of_sine.sine_error < 0.01);
  CHECK(of_triangle.triangle_error < 0.01);
  CHECK(of_square.flat_error < 0.01);
  CHECK(of_sine.triangle_error > 3.0 * of_sine.sine_error);
  CHECK(of_triangle.sine_error > 3.0 * of_triangle.triangle_error);
  CHECK(of_square.sine_error > 3.0 * of_square.flat_error);
  CHECK(of_sine.third_in_phase == Approx(0.0).margin(0.02));
  CHECK(of_triangle.third_in_phase == Approx(1.0 / 9.0).margin(0.02));
  CHECK(of_square.third_in_phase == Approx(-1.0 / 3.0).margin(0.03));
  CHECK(of_sine.kurtosis == Approx(1.5).margin(0.05));
  CHECK(of_triangle.kurtosis == Approx(1.8).margin(0.05));
  CHECK(of_square.kurtosis == Approx(1.0).margin(0.05));
  CHECK(of_sine.repeats == Approx(1.0).margin(0.02));
}

TEST_CASE("area before over after the peak detects a late peak") {
  const auto late = [](double k) {
    const double t = k / kCyclePeriod - std::floor(k / kCyclePeriod);
    const double half = t < 0.5 ? 2.0 * t : 2.0 * t - 1.0;
    const double value = half < 0.8 ? half / 0.8 : (1.0 - half) / 0.2;
    return t < 0.5 ? value : -value;
  };
  CHECK(waveform(made_of(800, late), kCyclePeriod).area_ratio > 1.7);
  CHECK(waveform(cycle(sine), kCyclePeriod).area_ratio == Approx(1.0).margin(0.25));
}

TEST_CASE("too few half cycles have no shape") {
  const Series few = made_of(60, [](double k) { return sine(k / 40.0); });
  CHECK(waveform(few, kCyclePeriod).half_cycles == 0);
  CHECK(waveform(few, kCyclePeriod).sine_error == 1.0);
}

TEST_CASE("square against triangle correlates oddly, opposite sines evenly") {
  // CO integrates the error: the triangle reverses where the square wave jumps.
  Series falling = cycle(triangle);
  for (double& v : falling) v = -v;
  const CrossCorrelation odd = cross_correlation(cycle(square), falling, kCyclePeriod);
  CHECK(odd.odd_share > 0.95);
  CHECK(std::abs(odd.at_zero) < 0.2);
  const CrossCorrelation even = cross_correlation(cycle(sine), cycle(sine, 0.5), kCyclePeriod);
  CHECK(even.odd_share < 0.05);
  CHECK(even.at_zero == Approx(-1.0).margin(0.02));
  CHECK(even.coherence == Approx(1.0).margin(0.01));
}

TEST_CASE("the controller between error and output is seen: action and share of integral") {
  const Series error = with_noise(cycle(sine), 0.3, 5);
  Series proportional = error;
  for (double& v : proportional) v = -2.0 * v;
  const ControllerFit p = fit_controller(error, proportional, kCyclePeriod);
  CHECK(p.action == 1.0);
  CHECK(p.integral_share < 0.02);
  CHECK(p.fit == Approx(1.0).margin(0.01));
  Series integral(error.size());
  double sum = 0.0;
  for (std::size_t k = 0; k < error.size(); ++k) integral[k] = sum += 0.1 * error[k];
  const ControllerFit i = fit_controller(error, integral, kCyclePeriod);
  CHECK(i.action == -1.0);
  CHECK(i.integral_share > 0.9);
}

}  // namespace
}  // namespace loopwarden::tests::shapes_test
