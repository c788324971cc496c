// SPDX-License-Identifier: Apache-2.0
#include "model/watch/condition_watch.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/numeric/random.hpp"

namespace condition_watch_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;
using loopwarden::analysis::ConditionIndices;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kSampleTime = 0.1;  // s
constexpr std::uint64_t kStretch = kWindowSamples;
constexpr WindowSettings kSettings{.sample_time_s = kSampleTime, .co_low = 0.0, .co_high = 20.0};

// CO steps by 10 % of its span up and down every 12 s.
double steps(std::uint64_t k) { return k / 120 % 2 == 0 ? 9.0 : 11.0; }

Cycle cycle(std::uint64_t k, double stem) {
  return {.period_index = k, .sp = 0.0, .pv = 0.0, .co = steps(k), .stem = stem};
}

alarm::AlarmConditions raised(alarm::AlarmKind kind, double severity_percent) {
  alarm::AlarmConditions conditions{};
  conditions[index_of(kind)] = {true, severity_percent};
  return conditions;
}

}  // namespace

TEST_CASE("before a stretch is full, and without read-back and judge, no index is reported",
          "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  for (std::uint64_t k = 1; k < kStretch; ++k) watch.add(cycle(k, kNan), {});
  CHECK(std::isnan(watch.indices().environment));
  watch.add(cycle(kStretch, kNan), {});
  WindowMeasures measures;
  // The upper bound from PV and CO is no measurement.
  measures.stick_percent = 9.0;
  measures.stick_source = alarm::StickSource::ellipse;
  measures.variability_percent = 0.3;
  measures.mean_error_percent = 0.4;
  watch.window(measures, nullptr);
  const ConditionIndices indices = watch.indices();
  CHECK(indices.environment == 100.0);
  CHECK(indices.control_performance == Approx(100.0 * (1.0 - 0.5 / 5.0)));
  CHECK(std::isnan(indices.valve));
  CHECK(std::isnan(indices.actuator));
  CHECK(std::isnan(indices.positioner));
}

TEST_CASE("the lag of a first-order stem, and its distance from CO", "[monitor][condition]") {
  for (const double lag_s : {0.5, 3.0, 12.0}) {
    for (const double noise : {0.0, 0.01}) {
      ConditionWatch watch(kSettings);
      loopwarden::numeric::Random random(5);
      double stem = 9.0;
      double deviation = 0.0;
      for (std::uint64_t k = 0; k < kStretch; ++k) {
        stem += (1.0 - std::exp(-kSampleTime / lag_s)) * (steps(k) - stem);
        const double read_back = stem + noise * random.normal();
        watch.add(cycle(k, read_back), {});
        deviation += std::abs(steps(k) - read_back) / static_cast<double>(kStretch);
      }
      INFO("lag " << lag_s << " noise " << noise);
      CHECK(watch.inputs().stem_lag_s == Approx(lag_s).epsilon(0.1).margin(0.1));
      CHECK(watch.inputs().stem_deviation_percent == Approx(100.0 * deviation / 20.0));
      CHECK(watch.indices().actuator == Approx(100.0 * (1.0 - watch.inputs().stem_lag_s / 30.0)));
    }
  }
}

TEST_CASE("no index is known while PV is frozen", "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  for (std::uint64_t k = 0; k < kStretch; ++k) watch.add(cycle(k, steps(k)), {});
  REQUIRE(watch.indices().environment == 100.0);
  watch.add(cycle(kStretch, steps(kStretch)), {.pv_frozen = true});
  const ConditionIndices frozen = watch.indices();
  for (const double index : {frozen.control_performance, frozen.valve, frozen.actuator,
                             frozen.positioner, frozen.environment}) {
    CHECK(std::isnan(index));
  }
  watch.add(cycle(kStretch + 1, steps(kStretch)), {});
  CHECK(watch.indices().environment == 100.0);
}

TEST_CASE("without a known CO the stem has no comparison", "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  for (std::uint64_t k = 0; k < kStretch; ++k) {
    Cycle one = cycle(k, steps(k) - 0.4);
    if (k < kStretch / 2) one.co = kNan;
    watch.add(one, {});
  }
  CHECK(watch.inputs().stem_deviation_percent == Approx(100.0 * 0.4 / 20.0));
  CHECK(std::isfinite(watch.inputs().stem_lag_s));
  CHECK(watch.inputs().read_back_bad_share == 0.0);
  for (std::uint64_t k = 0; k < kStretch; ++k) {
    Cycle one = cycle(kStretch + k, steps(k));
    one.co = kNan;
    watch.add(one, {});
  }
  CHECK(std::isnan(watch.inputs().stem_deviation_percent));
  CHECK(std::isnan(watch.inputs().stem_lag_s));
}

TEST_CASE("a stem at rest has no measurable lag; CO away from it counts", "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  for (std::uint64_t k = 0; k < kStretch; ++k) watch.add(cycle(k, 9.7), {});
  CHECK(std::isnan(watch.indices().actuator));
  // 0.7 and 1.3 of 20 alternate: 5 %, beyond the limit.
  CHECK(watch.inputs().stem_deviation_percent == Approx(5.0).margin(0.1));
  CHECK(watch.indices().positioner == 0.0);
}

TEST_CASE("bad read-backs, bad PV, late and missing cycles are shares of the stretch",
          "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  std::uint64_t k = 0;
  for (; k < 915; ++k) {
    // A read-back that was there before counts as missing later.
    watch.add(cycle(k, k < 24   ? kNan
                       : k < 48 ? steps(k)
                       : k < 96 ? kNan
                                : steps(k)),
              {.pv_bad = k < 48, .cycle_bad = k < 5});
  }
  k += 5;  // five are missing
  for (; k < kStretch; ++k) watch.add(cycle(k, steps(k)), {});
  CHECK(watch.inputs().read_back_bad_share == Approx(48.0 / 961.0));
  CHECK(watch.inputs().pv_bad_share == Approx(48.0 / 961.0));
  CHECK(watch.inputs().cycle_bad_share == Approx(10.0 / 961.0));
  CHECK(watch.indices().positioner == Approx(100.0 * (1.0 - 480.0 / 961.0)));
  CHECK(watch.indices().environment == Approx(100.0 * (1.0 - 500.0 / 961.0)));
  // The next stretch forgets it.
  for (; k < 2 * kStretch; ++k) watch.add(cycle(k, steps(k)), {});
  CHECK(watch.indices().environment == 100.0);
  CHECK(watch.indices().positioner == 100.0);
}

TEST_CASE(
    "the stick band from the read-back and from alarms lowers the valve, low air the actuator",
    "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  alarm::WindowMeasures measures;
  const alarm::AlarmConditions none{};
  for (const alarm::AlarmKind kind :
       {alarm::AlarmKind::stiction, alarm::AlarmKind::backlash, alarm::AlarmKind::hysteresis}) {
    const alarm::AlarmConditions conditions = raised(kind, 4.0);
    watch.window(measures, &conditions);
    CHECK(watch.indices().valve == Approx(60.0));
    CHECK(std::isnan(watch.indices().actuator));
  }
  measures.stick_percent = 7.0;
  measures.stick_source = alarm::StickSource::read_back;
  watch.window(measures, &none);
  CHECK(watch.indices().valve == Approx(30.0));
  const alarm::AlarmConditions low_air = raised(alarm::AlarmKind::low_air_supply, 1.0);
  watch.window({}, &low_air);
  CHECK(watch.indices().actuator == 0.0);
  CHECK(std::isnan(watch.indices().valve));
  // A window that can't be judged ends no alarm, and shows no health.
  watch.window({}, nullptr);
  CHECK(watch.indices().actuator == 0.0);
  CHECK(std::isnan(watch.indices().valve));
}

TEST_CASE("valve and stick are unknown until a window has passed since the last change of verdict",
          "[monitor][condition]") {
  // CO swings by 10 % of its span; the stem follows at once, then only after CO has moved 6 % from
  // its turning point.
  constexpr double kStuck = 1.2;  // CO units
  WindowSettings settings = kSettings;
  settings.overlap = 0.0;
  ConditionWatch watch(settings);
  WindowBuilder builder(settings);
  std::uint64_t k = 0;
  double stem = 10.0;
  double last_co = 10.0;
  double turn = 10.0;
  bool up = true;
  const auto run = [&](std::uint64_t cycles, bool sticks) {
    alarm::WindowMeasures measures;
    for (std::uint64_t i = 0; i < cycles; ++i, ++k) {
      Cycle c = cycle(k, 0.0);
      c.automatic = c.pv_good = true;
      c.co = 10.0 + std::sin(2.0 * std::numbers::pi * static_cast<double>(k) / 240.0);
      if ((c.co > last_co) != up) turn = last_co;
      up = c.co > last_co;
      last_co = c.co;
      if (!sticks || std::abs(c.co - turn) > kStuck) stem = c.co;
      c.stem = stem;
      watch.add(c, {});
      if (builder.add(c) != WindowBuilder::Progress::full) continue;
      measures = measure(builder.window());
      watch.window(measures, nullptr);
      measures = watch.told(measures);
    }
    return measures;
  };

  const alarm::WindowMeasures healthy = run(2 * kStretch, false);
  CHECK(healthy.stick_source == alarm::StickSource::read_back);
  CHECK(healthy.stick_percent < 0.3);
  CHECK(watch.indices().valve > 97.0);

  // Half a window later it sticks, and the twin reports that something has changed.
  run(kStretch / 2, false);
  run(100, true);
  CHECK(watch.indices().valve > 97.0);  // no better value is available yet
  AlarmConditions conditions{};
  conditions[index_of(AlarmKind::model_gap)].on = true;
  CHECK(watch.verdict(conditions));
  CHECK_FALSE(watch.verdict(conditions));
  CHECK(std::isnan(watch.indices().valve));
  CHECK(std::isnan(watch.indices().actuator));

  // The window that ends now began before.
  const alarm::WindowMeasures mixed = run(kStretch - kStretch / 2 - 100, true);
  CHECK(mixed.stick_source == alarm::StickSource::none);
  CHECK(std::isnan(watch.indices().valve));
  CHECK(std::isfinite(watch.indices().control_performance));

  const alarm::WindowMeasures sticky = run(kStretch, true);
  CHECK(sticky.stick_source == alarm::StickSource::read_back);
  CHECK(sticky.stick_percent == Approx(100.0 * kStuck / 20.0).margin(1.0));
  CHECK(watch.indices().valve == Approx(10.0 * (10.0 - sticky.stick_percent)));

  // Repaired, and reported so: the sticky window doesn't describe the present valve.
  CHECK(watch.verdict({}));
  CHECK(std::isnan(watch.indices().valve));
  run(kStretch, false);
  CHECK(watch.indices().valve > 97.0);
}

TEST_CASE("an alarm of routine evidence lowers the valve without a window that was judged",
          "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  const alarm::AlarmConditions conditions = raised(alarm::AlarmKind::stiction, 4.0);
  CHECK(watch.verdict(conditions));
  CHECK(watch.indices().valve == Approx(60.0));
  watch.window({}, nullptr);
  CHECK(watch.indices().valve == Approx(60.0));
}

TEST_CASE("the absence of an alarm is no measurement of valve or actuator",
          "[monitor][condition]") {
  ConditionWatch watch(kSettings);
  // Judged, with a read-back whose stem never reversed: its stick was not measured.
  for (std::uint64_t k = 0; k < kStretch; ++k) watch.add(cycle(k, 9.0), {});
  alarm::AlarmConditions conditions{};
  alarm::WindowMeasures measures;
  watch.window(measures, &conditions);
  CHECK(std::isnan(watch.indices().valve));
  CHECK(std::isnan(watch.indices().actuator));
  CHECK(std::isfinite(watch.indices().positioner));
  // One window names stiction: too few for an alarm, but no sign of health.
  conditions[index_of(AlarmKind::stiction)] = {false, 6.8};
  watch.window(measures, &conditions);
  CHECK(std::isnan(watch.indices().valve));
  conditions[index_of(alarm::AlarmKind::stiction)].on = true;
  watch.window(measures, &conditions);
  CHECK(watch.indices().valve == Approx(32.0));
  // A measured stick band of zero is the best possible.
  measures.stick_source = StickSource::read_back;
  conditions = {};
  watch.window(measures, &conditions);
  CHECK(watch.indices().valve == 100.0);
}

}  // namespace condition_watch_test
