// SPDX-License-Identifier: Apache-2.0
// A slip jump that PV shows is found, and backlash has none.
#include "model/estimator/slip_jump.hpp"

#include <catch2/catch.hpp>

#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::slip_jump_test {
namespace {

using estimator::find_band;
using estimator::find_slip_jump;

const SmallLoop kLoop{.gain = 0.3, .integral_time = 2.0, .noise = 0.1};
constexpr double kPeriod = 60.0;  // samples

template <class Valve>
double jump_of(Valve valve, double load, double unit) {
  valve.reset(50.0);
  SmallLoop::Run run = kLoop.run(
      1000, [&](double u) { return valve.step(u); }, wandering_load(load));
  for (double& v : run.pv) v = 3.0 - unit * v;
  for (double& u : run.co) u *= unit;
  return find_slip_jump(run.pv, run.co, find_band(run.pv, run.co, kPeriod));
}

TEST_CASE("a slip jump is found in a sticking valve and not in one with backlash", "[band]") {
  CHECK(jump_of(effects::StictionChoudhury({.s = 5.0, .j = 3.0}), 0.0, 1.0) > 4.0);
  CHECK(jump_of(effects::Backlash(5.0), 1.3, 1.0) < 4.0);
}

TEST_CASE("units and direction keep the evidence on a slip jump", "[band]") {
  const effects::StictionChoudhury valve({.s = 5.0, .j = 3.0});
  CHECK(jump_of(valve, 0.0, 20.0) == Approx(jump_of(valve, 0.0, 1.0)).margin(0.5));
}

TEST_CASE("a record without movement has no evidence on a slip jump", "[band]") {
  const std::vector<double> still(200, 1.0);
  CHECK(find_slip_jump(still, still, {}) == 0.0);
  CHECK(find_slip_jump({}, {}, {}) == 0.0);
}

}  // namespace
}  // namespace loopwarden::tests::slip_jump_test
