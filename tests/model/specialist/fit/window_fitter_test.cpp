// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/fit/window_fitter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/model/specialist/judge/specialist_support.hpp"
#include "tests/support/rt_guard.hpp"

namespace window_fitter_test {

using namespace loopwarden;
using namespace loopwarden::specialist;
using tests::play_window;

namespace {

constexpr LoopFacts kFacts{0.1, 1.2, 1.7, 2.6, 0.0, 10.0, 0.0, 10.0};

double excess(const WindowFits& f, FaultModel e) { return f.of(e).mse / (f.noise * f.noise); }

}  // namespace

TEST_CASE("a healthy valve is explained down to the noise", "[specialist]") {
  const WindowFits f = WindowFitter(kFacts).fit(play_window(0.0, 0.02).view());
  REQUIRE(f.usable);
  // 0.02 of PV over the gain in % of CO span, mean of four samples.
  CHECK(f.noise == Approx(100.0 * 0.02 / 1.2 / 10.0 / 2.0).epsilon(0.15));
  CHECK(excess(f, FaultModel::healthy) < 1.5);
}

TEST_CASE("play is found with its size, but not in a healthy loop", "[specialist]") {
  for (const double deadband : {0.4, 0.7, 1.3}) {
    const WindowFits f = WindowFitter(kFacts).fit(play_window(deadband, 0.02).view());
    CHECK(excess(f, FaultModel::backlash) < 2.0);
    CHECK(excess(f, FaultModel::healthy) > 3.0 * excess(f, FaultModel::backlash));
    CHECK(excess(f, FaultModel::low_air_supply) > 2.0 * excess(f, FaultModel::backlash));
    CHECK(f.of(FaultModel::backlash).size == Approx(10.0 * deadband).epsilon(0.1));
  }
}

TEST_CASE("units, spans and a constant load don't change the fit", "[specialist]") {
  const WindowFits volts = WindowFitter(kFacts).fit(play_window(0.7, 0.02).view());
  // CO as 4 to 20 mA, PV 50 m3/h per unit, with 30 m3/h from elsewhere.
  LoopFacts other{0.1, 1.2 * 50.0 / 1.6, 1.7, 2.6, 4.0, 20.0, 0.0, 500.0};
  tests::PlayWindow w = play_window(0.7, 0.02, 1.6, 4.0, 50.0);
  for (double& pv : w.pv) pv += 30.0;
  const WindowFits plant = WindowFitter(other).fit(w.view());
  CHECK(plant.noise == Approx(volts.noise).epsilon(1e-3));
  for (std::size_t i = 0; i < kFaultModels; ++i) {
    CHECK(plant.fits[i].mse == Approx(volts.fits[i].mse).epsilon(0.02));
  }
}

TEST_CASE("a model that is a little off is no fault, one that is far off fits another process",
          "[specialist]") {
  LoopFacts off = kFacts;
  off.gain *= 1.04;
  off.time_constant_s *= 0.92;
  off.dead_time_s += 0.1;
  const WindowFits near = WindowFitter(off).fit(play_window(0.0, 0.02).view());
  CHECK(excess(near, FaultModel::healthy) < 2.0);
  off.gain = 1.6 * kFacts.gain;
  const WindowFits far = WindowFitter(off).fit(play_window(0.0, 0.02).view());
  CHECK(excess(far, FaultModel::healthy) > 5.0);
  CHECK(excess(far, FaultModel::other_process) < 2.0);
  CHECK(far.of(FaultModel::other_process).gain_off < -0.5);
}

TEST_CASE("missing samples hold the last one; too many make a window useless", "[specialist]") {
  tests::PlayWindow w = play_window(0.7, 0.02);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 300; k < 315; ++k) w.pv[k] = nan;
  const WindowFits f = WindowFitter(kFacts).fit(w.view());
  CHECK(f.usable);
  CHECK(f.of(FaultModel::backlash).size == Approx(7.0).epsilon(0.15));
  for (std::size_t k = 300; k < 600; ++k) w.pv[k] = nan;
  CHECK_FALSE(WindowFitter(kFacts).fit(w.view()).usable);
  w.pv.pop_back();
  CHECK_FALSE(WindowFitter(kFacts).fit(w.view()).usable);
}

TEST_CASE("explaining a window does not allocate", "[specialist]") {
  WindowFitter fitter(kFacts);
  const tests::PlayWindow w = play_window(0.7, 0.02);
  tests::RealTimeSection::reset();
  bool usable = false;
  {
    const tests::RealTimeSection section;
    usable = fitter.fit(w.view()).usable;
  }
  CHECK(usable);
  CHECK(tests::RealTimeSection::offences() == 0);
}

}  // namespace window_fitter_test
