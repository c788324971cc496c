// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/window_measures.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "model/watch/mode_times.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/numeric/random.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"

namespace window_measures_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kSampleTime = 0.1;  // s

struct Samples {
  std::vector<double> sp = std::vector<double>(kWindowSamples, 5.0);
  std::vector<double> pv = std::vector<double>(kWindowSamples, 5.0);
  std::vector<double> co = std::vector<double>(kWindowSamples, 5.0);
  std::vector<double> stem = std::vector<double>(kWindowSamples, kNan);
  // Spans of 10 and 20.
  WindowMeasures measured() const {
    return measure({{.period_s = kSampleTime,
                     .pv = pv,
                     .sp = sp,
                     .co = co,
                     .stem = stem,
                     .pv_low = 0.0,
                     .pv_high = 10.0,
                     .co_low = 0.0,
                     .co_high = 20.0}});
  }
};

double wave(std::size_t k, double period_s) {
  return std::sin(2.0 * std::numbers::pi * static_cast<double>(k) * kSampleTime / period_s);
}

}  // namespace

TEST_CASE("an oscillation in noise: index and period", "[monitor][measures]") {
  Samples s;
  loopwarden::numeric::Random random(7);
  for (std::size_t k = 0; k < kWindowSamples; ++k) {
    s.pv[k] = 5.0 + 0.5 * wave(k, 8.0) + 0.1 * random.normal();
  }
  WindowMeasures m = s.measured();
  CHECK(m.oscillation_index > 2.0);
  CHECK(m.period_s == Approx(8.0).epsilon(0.05));
  for (std::size_t k = 0; k < kWindowSamples; ++k) s.pv[k] = 5.0 + 0.1 * random.normal();
  m = s.measured();
  CHECK(m.oscillation_index <= 1.0);
  CHECK(m.period_s == 0.0);
  CHECK(m.stick_source == StickSource::none);
}

TEST_CASE("variability and mean error in percent of the PV span", "[monitor][measures]") {
  Samples s;
  for (std::size_t k = 0; k < kWindowSamples; ++k) s.pv[k] = 4.0 + (k % 2 == 0 ? 0.2 : -0.2);
  const WindowMeasures m = s.measured();
  CHECK(m.mean_error_percent == Approx(10.0).epsilon(0.001));
  CHECK(m.variability_percent == Approx(2.0).epsilon(0.001));
}

TEST_CASE("the share of a window at an end of the output", "[monitor][measures]") {
  Samples s;
  for (std::size_t k = 0; k < 96; ++k) s.co[k] = 20.0;
  for (std::size_t k = 96; k < 144; ++k) s.co[k] = 0.0;
  for (std::size_t k = 144; k < kWindowSamples; ++k) s.co[k] = 19.99;
  CHECK(s.measured().saturated_percent == Approx(100.0 * 144.0 / 961.0));
}

TEST_CASE("travel and reversals are the stem's, or CO's without a read-back",
          "[monitor][measures]") {
  Samples s;
  // Up and down by 2 of 20 units, 10 samples each way: 48 reversals in 48 strokes.
  for (std::size_t k = 0; k < kWindowSamples; ++k) {
    const double stroke = static_cast<double>(k % 20);
    s.co[k] = 5.0 + 0.2 * (stroke <= 10.0 ? stroke : 20.0 - stroke);
  }
  const double hours = 961.0 * kSampleTime / 3600.0;
  WindowMeasures m = s.measured();
  CHECK(m.travel_percent_per_hour == Approx(960.0 * 1.0 / hours).epsilon(0.01));
  CHECK(m.reversals_per_hour == Approx(95.0 / hours).epsilon(0.02));
  std::fill(s.stem.begin(), s.stem.end(), 5.0);
  m = s.measured();
  CHECK(m.travel_percent_per_hour == 0.0);
  CHECK(m.reversals_per_hour == 0.0);
}

TEST_CASE("with a read-back, stick is the band of the recorded valve", "[monitor][measures]") {
  Samples s;
  const double period_s = 20.0;
  for (std::size_t k = 0; k < kWindowSamples; ++k) s.co[k] = 10.0 + 4.0 * wave(k, period_s);
  SECTION("backlash") {
    for (const double deadband : {0.4, 1.0, 2.0}) {
      effects::Backlash valve(deadband);
      valve.reset(10.0);
      for (std::size_t k = 0; k < kWindowSamples; ++k) s.stem[k] = valve.step(s.co[k]);
      const WindowMeasures m = s.measured();
      CHECK(m.stick_source == StickSource::read_back);
      CHECK(m.stick_percent == Approx(100.0 * deadband / 20.0).margin(0.7));
    }
  }
  SECTION("stiction") {
    for (const double band : {0.6, 1.2, 2.4}) {
      effects::StictionChoudhury valve(effects::StictionParameters{.s = band, .j = 0.5 * band});
      valve.reset(10.0);
      for (std::size_t k = 0; k < kWindowSamples; ++k) s.stem[k] = valve.step(s.co[k]);
      CHECK(s.measured().stick_percent == Approx(100.0 * band / 20.0).margin(0.9));
    }
  }
  SECTION("none") {
    s.stem = s.co;
    CHECK(s.measured().stick_percent < 0.5);
  }
}

TEST_CASE("without a read-back, stick is the width of the ellipse, and only of a cycle",
          "[monitor][measures]") {
  Samples s;
  const double period_s = 12.0;
  const double lag = 0.7;  // rad
  for (std::size_t k = 0; k < kWindowSamples; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) * kSampleTime / period_s;
    s.co[k] = 10.0 + 3.0 * std::sin(angle);
    s.pv[k] = 5.0 + 0.8 * std::sin(angle - lag);
  }
  const WindowMeasures m = s.measured();
  CHECK(m.stick_source == StickSource::ellipse);
  // The chord of the ellipse through its centre.
  CHECK(m.stick_percent == Approx(100.0 * 2.0 * 3.0 * std::sin(lag) / 20.0).epsilon(0.03));
  std::fill(s.pv.begin(), s.pv.end(), 5.0);
  CHECK(s.measured().stick_source == StickSource::none);
}

TEST_CASE("windows without samples or spans give zeros", "[monitor][measures]") {
  const WindowMeasures m = measure({});
  CHECK(m.travel_percent_per_hour == 0.0);
  Samples s;
  const WindowMeasures no_span = measure(
      {{.pv = s.pv, .sp = s.sp, .co = s.co, .stem = s.stem, .co_low = 1.0, .co_high = 1.0}});
  CHECK(no_span.saturated_percent == 0.0);
}

TEST_CASE("time in each mode and at the limits", "[monitor][measures]") {
  using loopwarden::control::Mode;
  ModeTimes times(0.1);
  for (int i = 0; i < 100; ++i) times.add(Mode::automatic, i < 25);
  for (int i = 0; i < 30; ++i) times.add(Mode::manual, false);
  times.add(static_cast<Mode>(200), false);
  CHECK(times.seconds_in(Mode::automatic) == Approx(10.0));
  CHECK(times.seconds_in(Mode::manual) == Approx(3.0));
  CHECK(times.seconds_in(Mode::fallback) == 0.0);
  CHECK(times.seconds_at_limit() == Approx(2.5));
}

}  // namespace window_measures_test
