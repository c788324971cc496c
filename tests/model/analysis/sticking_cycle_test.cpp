// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/sticking_cycle.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/analysis/identification.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/process.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"

namespace sticking_cycle_test {

using namespace loopwarden;
using namespace loopwarden::analysis;

namespace {

constexpr double kPeriod = 0.5;  // s
constexpr plant::ProcessParameters kProcess{
    .gain = 1.3, .time_constant_s = 4.0, .dead_time_s = 1.5};
constexpr double kSetPoint = 60.0;

struct Loop {
  effects::StictionParameters valve{};
  double kp = 0.5;
  double ki = 0.2;
  double load = 0.0;    // PV units, amplitude of a sine of 60 s
  double wander = 0.0;  // PV units a sample
};

struct Run {
  std::vector<double> co, pv, stem;
};

// PI with a constant SP.
Run run_of(const Loop& loop, std::uint64_t seed, std::size_t samples = 3000) {
  Run r;
  numeric::Random random(seed);
  effects::StictionChoudhury valve(loop.valve);
  plant::Process process(kProcess, kPeriod);
  const double rest = kSetPoint / kProcess.gain;
  process.reset(valve.reset(rest));
  double q = kSetPoint;
  double integral = rest + 5.0;
  double wander = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    wander += loop.wander * random.normal();
    const double phase = 2.0 * std::numbers::pi * static_cast<double>(k) * kPeriod / 60.0;
    r.pv.push_back(q + wander + loop.load * std::sin(phase) + 0.1 * random.normal());
    const double error = kSetPoint - r.pv.back();
    integral += loop.ki * kPeriod * error;
    r.co.push_back(loop.kp * error + integral);
    r.stem.push_back(valve.step(r.co.back()));
    q = process.step(r.stem.back());
  }
  return r;
}

}  // namespace

TEST_CASE("a limit cycle identifies the valve and the process after it",
          "[analysis][identification]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Run r = run_of({.valve = {.s = 5.0, .j = 2.0}, .wander = 0.005}, seed);
    const auto found = find_sticking_cycle(r.co, r.pv, kPeriod);
    REQUIRE(found);
    CHECK(found->s.value == Approx(5.0).epsilon(0.12));
    CHECK(found->gain.value * found->j.value == Approx(1.3 * 2.0).epsilon(0.2));
    CHECK(found->time_constant_s.value == Approx(4.0).epsilon(0.2));
    CHECK(found->dead_time_s.value == Approx(1.5).margin(0.5));
    CHECK(found->stem_reversals >= 6);
    CHECK(found->fit_percent > 60.0);
    CHECK(found->free_run.size() == r.pv.size());
  }
}

TEST_CASE("a swing that no valve causes gives no result", "[analysis][identification]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Run pushed = run_of({.load = 3.0, .wander = 0.02}, seed);
    CHECK_FALSE(find_sticking_cycle(pushed.co, pushed.pv, kPeriod));
    const Run tight = run_of({.kp = 2.2, .ki = 0.5, .wander = 0.02}, seed);
    CHECK_FALSE(find_sticking_cycle(tight.co, tight.pv, kPeriod));
    const Run still = run_of({.wander = 0.02}, seed);
    CHECK_FALSE(find_sticking_cycle(still.co, still.pv, kPeriod));
  }
}

TEST_CASE("a short or still record is no cycle", "[analysis][identification]") {
  const Run r = run_of({.valve = {.s = 5.0, .j = 2.0}}, 1, 60);
  CHECK_FALSE(find_sticking_cycle(r.co, r.pv, kPeriod));
  const std::vector<double> still(500, 3.0);
  CHECK_FALSE(find_sticking_cycle(still, still, kPeriod));
}

TEST_CASE("a cycle without SP is identified, and suggests a loop model with its SP",
          "[analysis][identification]") {
  const Run r = run_of({.valve = {.s = 5.0, .j = 4.8}, .kp = 0.1, .ki = 0.1, .wander = 0.005}, 5);
  const numeric::LoopView record{.period_s = kPeriod, .pv = r.pv, .co = r.co};
  const Identification found = identify(record);
  REQUIRE(found.cycle);
  REQUIRE(found.can_tell());
  CHECK(found.best().gain.value == Approx(1.3).epsilon(0.1));
  CHECK(found.best().free_run.size() == found.used.count);
  const AssumedModel assumed = assumed_model(record);
  REQUIRE(assumed.model);
  CHECK(assumed.controller_known);
  CHECK(assumed.model->controller.pid.gains.kp == Approx(0.1).epsilon(0.02));
  CHECK(assumed.model->controller.pid.gains.ki == Approx(0.1).epsilon(0.02));
  REQUIRE(assumed.model->scenario.set_point.size() == 1);
  CHECK(assumed.model->scenario.set_point[0].second == Approx(kSetPoint).epsilon(0.001));
  CHECK(assumed.model->valve_effects.empty());
  CHECK(assumed.model->transmitter_effects.empty());
  CHECK(assumed.model->process.level.has_value());
}

TEST_CASE("with a read-back, the slip jump and the process are those of the stem",
          "[analysis][identification]") {
  const Run r = run_of({.valve = {.s = 5.0, .j = 2.0}, .wander = 0.005}, 1);
  numeric::Random random(2);
  std::vector<double> stem;
  for (const double x : r.stem) stem.push_back(x + 0.01 * random.normal());
  const Identification found =
      identify({.period_s = kPeriod, .pv = r.pv, .co = r.co, .stem = stem});
  REQUIRE(found.cycle);
  CHECK(found.cycle->j.value == Approx(2.0).epsilon(0.15));
  CHECK(found.cycle->j.low <= 2.0);
  CHECK(found.cycle->j.high >= 2.0);
  REQUIRE(found.can_tell());
  CHECK(found.best().gain.value == Approx(1.3).epsilon(0.05));
  CHECK(found.best().time_constant_s.value == Approx(4.0).epsilon(0.15));
}

TEST_CASE("a stem that rests after each slip shows gain times slip jump, not the gain",
          "[analysis][identification]") {
  const Run r = run_of({.valve = {.s = 5.0, .j = 2.0}, .wander = 0.005}, 1);
  const numeric::LoopView record{.period_s = kPeriod, .pv = r.pv, .co = r.co};
  const Identification found = identify(record);
  REQUIRE(found.cycle);
  REQUIRE_FALSE(found.can_tell());
  CHECK_THAT(found.reason, Catch::Contains("gain times slip jump"));
  CHECK(found.cycle->gain.value * found.cycle->j.value == Approx(1.3 * 2.0).epsilon(0.2));
  const AssumedModel assumed = assumed_model(record);
  REQUIRE(assumed.model);
  CHECK(assumed.model->uncertainty.gain >= 0.3);
}

}  // namespace sticking_cycle_test
