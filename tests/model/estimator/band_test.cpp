// SPDX-License-Identifier: Apache-2.0
// The likelihood of a band: found in a sticking loop, not in a healthy one, whatever the units.
#include "model/estimator/band.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <span>
#include <vector>

#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::band_test {
namespace {

using estimator::BandEvidence;
using estimator::find_band;

const SmallLoop kLoop{.gain = 0.3, .integral_time = 2.0, .noise = 0.1};
constexpr double kPeriod = 60.0;  // samples

SmallLoop::Run sticking() {
  effects::StictionChoudhury valve({.s = 5.0, .j = 3.0});
  valve.reset(50.0);
  return kLoop.run(
      1000, [&](double u) { return valve.step(u); }, wandering_load(1.3));
}

TEST_CASE("a sticking valve needs a band, with its size", "[band]") {
  const SmallLoop::Run run = sticking();
  const BandEvidence found = find_band(run.pv, run.co, kPeriod);
  CHECK(found.log_odds > 15.0);
  CHECK(found.band == Approx(4.3).epsilon(0.3));
  CHECK(found.low <= found.band);
  CHECK(found.high >= found.band);
  CHECK(found.explained > 0.5);
}

TEST_CASE("a healthy valve needs no band, also if an archive holds its values", "[band]") {
  SmallLoop::Run run = kLoop.run(
      1000, [](double u) { return u; }, wandering_load(0.0, 0.5));
  CHECK(find_band(run.pv, run.co, kPeriod).log_odds < 0.0);
  double held = run.co.front();
  for (double& u : run.co) u = held = std::abs(u - held) > 1.0 ? u : held;
  CHECK(find_band(run.pv, run.co, kPeriod).log_odds < 4.0);
}

TEST_CASE("a band that is small against CO's movement is that of a healthy valve", "[band]") {
  effects::Backlash valve(0.6);
  valve.reset(50.0);
  const SmallLoop::Run run = kLoop.run(
      1000, [&](double u) { return valve.step(u); },
      [](double t) { return 6.0 * square(t / 90.0); });
  CHECK(find_band(run.pv, run.co, kPeriod).log_odds < 0.0);
}

TEST_CASE("units, direction and averaging keep the evidence", "[band]") {
  SmallLoop::Run run = sticking();
  const BandEvidence before = find_band(run.pv, run.co, kPeriod);
  for (double& v : run.pv) v = 3.0 - 70.0 * v;
  for (double& u : run.co) u = 4.0 + 0.16 * u;
  const BandEvidence scaled = find_band(run.pv, run.co, kPeriod);
  CHECK(scaled.log_odds == Approx(before.log_odds).margin(0.1));
  CHECK(scaled.band == Approx(0.16 * before.band).epsilon(0.01));
  CHECK(scaled.process.gain == Approx(-70.0 / 0.16 * before.process.gain).epsilon(0.01));
  // A slow loop that was logged fast is averaged.
  std::vector<double> pv, co;
  for (std::size_t k = 0; k < 4 * run.pv.size(); ++k) {
    pv.push_back(run.pv[k / 4]);
    co.push_back(run.co[k / 4]);
  }
  CHECK(find_band(pv, co, 4.0 * kPeriod).log_odds > 10.0);
}

TEST_CASE("records without movement have no evidence", "[band]") {
  const std::vector<double> still(200, 1.0);
  const SmallLoop::Run run = sticking();
  CHECK(find_band({}, {}, kPeriod).log_odds == 0.0);
  CHECK(find_band(still, still, kPeriod).log_odds == 0.0);
  CHECK(find_band(std::span(run.pv).first(20), std::span(run.co).first(20), kPeriod).log_odds ==
        0.0);
}

}  // namespace
}  // namespace loopwarden::tests::band_test
