// SPDX-License-Identifier: Apache-2.0
// Routine evidence of a running loop: it takes more than one window, forgets unobservable effects,
// and is weighed against the verdicts of the specialists.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "model/watch/loop_monitor.hpp"
#include "model/watch/limits.hpp"
#include "model/watch/routine_watch.hpp"
#include "model/effects/stiction/stiction_karnopp.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::routine_watch_test {
namespace {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;

constexpr double kSetPoint = 20.0;  // in the form of SmallLoop

// Samples of 2 s: the first level uses each unchanged.
const WindowSettings kSettings{.sample_time_s = 2.0};

SmallLoop::Run sticky(std::size_t samples, double s = 4.0) {
  effects::StictionKarnopp valve({.s = s, .j = 0.75 * s}, 0.5);
  valve.reset(50.0);
  return SmallLoop{.gain = 0.3, .integral_time = 2.0}.run(
      samples, [&](double u) { return valve.step(u); }, wandering_load(1.3));
}

SmallLoop::Run disturbed(std::size_t samples) {
  return SmallLoop{.gain = 0.5, .integral_time = 3.0}.run(
      samples, [](double u) { return u; }, [](double t) { return 4.0 * sine(t / 25.0); });
}

Cycle cycle_of(const SmallLoop::Run& run, std::size_t k, std::uint64_t period) {
  return {.period_index = period,
          .sp = kSetPoint,
          .pv = run.pv[k],
          .co = run.co[k],
          .stem = std::numeric_limits<double>::quiet_NaN(),
          .automatic = true,
          .pv_good = true};
}

bool stiction_on(const RoutineWatch& watch) {
  return watch.conditions()[index_of(AlarmKind::stiction)].on;
}

TEST_CASE("a sticking valve raises its condition after two windows, not after one", "[routine]") {
  const auto run = sticky(4 * watch::WatchLimits::kRoutineSamples);
  RoutineWatch watch(kSettings);
  std::size_t windows = 0;
  std::size_t raised_at = 0;
  for (std::size_t k = 0; k < run.pv.size() && raised_at == 0; ++k) {
    if (!watch.add(cycle_of(run, k, k))) continue;
    ++windows;
    CHECK(watch.judgement().verdict == diagnosis::DiagnosisVerdict::valve_effect);
    if (stiction_on(watch)) raised_at = k;
  }
  CHECK(raised_at == 2 * watch::WatchLimits::kRoutineSamples - 1);
  CHECK(windows == 2);
  const AlarmCondition& condition = watch.conditions()[index_of(AlarmKind::stiction)];
  CHECK(condition.severity_percent == Approx(4.0).epsilon(0.5));
}

TEST_CASE("the content of routine evidence and its next judgement are available at any time",
          "[routine]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  RoutineWatch watch(kSettings);
  auto feed = [&, k = std::size_t{0}](std::size_t cycles) mutable {
    for (const std::size_t end = k + cycles; k < end; ++k) watch.add(cycle_of(run, k, k));
    return watch.levels().front();
  };
  const RoutineWatch::Progress begun = feed(300);
  CHECK(begun.window_s == 1500.0);
  CHECK(begun.filled_s == 600.0);
  CHECK(begun.windows == 0);
  const RoutineWatch::Progress judged = feed(500);
  CHECK(judged.windows == 1);
  CHECK(judged.filled_s == 100.0);
  CHECK(judged.verdict == diagnosis::DiagnosisVerdict::valve_effect);
  CHECK(judged.fault == AlarmKind::stiction);
  CHECK(judged.probability > 0.6);
  CHECK(judged.severity_percent == Approx(4.0).epsilon(0.5));
  CHECK(judged.sum > 0.0);
  CHECK(judged.sum < watch::WatchLimits::kRaise);
  CHECK(feed(700).sum >= watch::WatchLimits::kRaise);
  CHECK(watch.levels().back().window_s == 64.0 * 750.0);
  CHECK(watch.levels().back().windows == 0);
}

TEST_CASE("two windows with a break between are no single record", "[routine]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  RoutineWatch watch(kSettings);
  std::vector<double> lengths;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    const std::size_t gap = k < watch::WatchLimits::kRoutineSamples ? 0 : 10;
    if (watch.add(cycle_of(run, k, k + gap))) lengths.push_back(watch.judgement().window_s);
  }
  CHECK(lengths == std::vector<double>{1500.0, 1500.0});
}

// Returns the same from a source that reports a value when it has changed by more than a band.
SmallLoop::Run on_change(SmallLoop::Run run, double pv_band, double co_band) {
  const auto hold = [](std::vector<double>& values, double band) {
    double held = values.front();
    for (double& value : values) {
      if (std::abs(value - held) > band) held = value;
      value = held;
    }
  };
  hold(run.pv, pv_band);
  hold(run.co, co_band);
  return run;
}

TEST_CASE("an effect that a source with report on change hides raises no alarm",
          "[routine][watch]") {
  WindowSettings settings = kSettings;
  settings.on_change = true;
  const auto raised = [](const SmallLoop::Run& run, RoutineWatch& watch) {
    bool any = false;
    for (std::size_t k = 0; k < run.pv.size(); ++k) {
      watch.add(cycle_of(run, k, k));
      any |= stiction_on(watch);
    }
    return any;
  };
  const auto wide = sticky(4 * watch::WatchLimits::kRoutineSamples);
  RoutineWatch plain(settings);
  CHECK(raised(wide, plain));
  CHECK(plain.judgement().sees_from_percent == 0.0);

  // Wider than the omitted changes: seen, and the smallest visible band is reported.
  RoutineWatch seen(settings);
  CHECK(raised(on_change(wide, 0.3, 1.0), seen));
  CHECK(seen.judgement().source.co.kind == analysis::ArchiveKind::exception);
  CHECK(seen.judgement().source.co.deviation == Approx(1.0).epsilon(0.1));
  CHECK(seen.judgement().source.pv.deviation == Approx(0.3).epsilon(0.1));
  CHECK(seen.judgement().sees_from_percent == Approx(2.0).epsilon(0.1));

  // Narrower than the omitted changes.
  RoutineWatch hidden(settings);
  CHECK_FALSE(
      raised(on_change(sticky(watch::WatchLimits::kRoutineSamples, 1.5), 0.1, 0.8), hidden));
  CHECK(hidden.judgement().verdict == diagnosis::DiagnosisVerdict::cant_tell);

  // The reports are too rare for a rule, so no rule is named. The effect is seen again when all
  // reports arrive.
  RoutineWatch seldom(settings);
  CHECK_FALSE(raised(on_change(wide, 0.05, 2.5), seldom));
  CHECK(std::isinf(seldom.judgement().sees_from_percent));
  for (std::size_t k = 0; k < wide.pv.size(); ++k) {
    seldom.add(cycle_of(wide, k, wide.pv.size() + k));
  }
  CHECK(seldom.judgement().sees_from_percent == 0.0);
  CHECK(stiction_on(seldom));
}

TEST_CASE("without a known SP there is routine evidence, and no window", "[routine][watch]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  WindowSettings settings = kSettings;
  settings.has_set_point = false;
  RoutineWatch watch(settings);
  WindowBuilder windows(settings);
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    Cycle cycle = cycle_of(run, k, k);
    cycle.sp = std::numeric_limits<double>::quiet_NaN();
    watch.add(cycle);
    CHECK(windows.add(cycle) != WindowBuilder::Progress::full);
  }
  CHECK(stiction_on(watch));
  CHECK(std::isnan(watch.samples().sp.front()));
  CHECK(windows.state() == WindowState::no_set_point);
}

TEST_CASE("a judgement's samples have SP as it was, through its changes and breaks", "[routine]") {
  constexpr std::size_t kWindow = watch::WatchLimits::kRoutineSamples;
  const auto run = sticky(4 * kWindow);
  RoutineWatch watch(kSettings);
  std::vector<float> expected;
  std::uint64_t period = 0;
  std::size_t judged = 0;
  for (std::size_t k = 0; k < run.pv.size(); ++k, ++period) {
    Cycle cycle = cycle_of(run, k, period);
    cycle.sp += static_cast<double>(k / 100 % 3);
    expected.push_back(static_cast<float>(cycle.sp));
    if (watch.add(cycle)) {
      const RoutineWatch::Samples samples = watch.samples();
      REQUIRE(samples.sp.size() == samples.pv.size());
      REQUIRE(samples.sp.size() <= expected.size());
      CHECK(std::equal(samples.sp.rbegin(), samples.sp.rend(), expected.rbegin()));
      ++judged;
    }
    if (k == kWindow / 2) {
      period += 100;
      expected.clear();
    }
  }
  CHECK(judged == 3);
}

TEST_CASE("a band as in a healthy valve raises no alarm, and clears a condition", "[routine]") {
  const auto run = sticky(4 * watch::WatchLimits::kRoutineSamples);
  // A band of 4 in a span of 2000 is 0.2 %, in one of 1000 0.4 %.
  const double half_span = GENERATE(500.0, 1000.0);
  const bool small = half_span > 500.0;
  RoutineWatch watch({.sample_time_s = 2.0, .co_low = -half_span, .co_high = half_span});
  std::size_t effects = 0;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    if (!watch.add(cycle_of(run, k, k))) continue;
    if (watch.judgement().verdict == diagnosis::DiagnosisVerdict::valve_effect) ++effects;
  }
  CHECK(effects >= 2);
  CHECK(stiction_on(watch) == !small);

  RoutineWatch restored({.sample_time_s = 2.0, .co_low = -half_span, .co_high = half_span});
  restored.restore(AlarmKind::stiction, true, 5.0);
  for (std::size_t k = 0; k < run.pv.size(); ++k) restored.add(cycle_of(run, k, k));
  CHECK(stiction_on(restored) == !small);
}

TEST_CASE("a disturbed loop raises no alarm, however long", "[routine]") {
  const auto run = disturbed(10 * watch::WatchLimits::kRoutineSamples);
  RoutineWatch watch(kSettings);
  std::size_t judged = 0;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    if (!watch.add(cycle_of(run, k, k))) continue;
    ++judged;
    CHECK(watch.judgement().sum == 0.0);
    for (const AlarmCondition& c : watch.conditions()) CHECK_FALSE(c.on);
  }
  // Each fifth window of samples of 4 s, and that of 16 s, ends with one of 2 s.
  CHECK(judged == 10);
}

TEST_CASE("a repaired valve clears its condition", "[routine]") {
  const auto bad = sticky(3 * watch::WatchLimits::kRoutineSamples);
  const auto good = disturbed(12 * watch::WatchLimits::kRoutineSamples);
  RoutineWatch watch(kSettings);
  std::uint64_t period = 0;
  for (std::size_t k = 0; k < bad.pv.size(); ++k) watch.add(cycle_of(bad, k, period++));
  REQUIRE(stiction_on(watch));
  for (std::size_t k = 0; k < good.pv.size(); ++k) watch.add(cycle_of(good, k, period++));
  CHECK_FALSE(stiction_on(watch));
}

TEST_CASE("manual, a bad PV or a gap of more than four samples begin the window again",
          "[routine]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  const auto why = GENERATE(0, 1, 2);
  const auto length = GENERATE(std::size_t{3}, std::size_t{4});
  RoutineWatch watch(kSettings);
  std::uint64_t period = 0;
  std::size_t first = 0;
  const std::size_t stop = watch::WatchLimits::kRoutineSamples / 2;
  for (std::size_t k = 0; k < run.pv.size() && first == 0; ++k) {
    if (k == stop) {
      for (std::size_t i = 0; i < length; ++i, ++period) {
        Cycle out = cycle_of(run, k, period);
        out.automatic = why != 0;
        out.pv_good = why != 1;
        if (why != 2) watch.add(out);
      }
    }
    if (watch.add(cycle_of(run, k, period++))) first = k + 1;
  }
  CHECK(first == (length == 4 ? stop : 0) + watch::WatchLimits::kRoutineSamples);
}

TEST_CASE("evidence is kept over a gap, but not over a stretch in manual", "[routine]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  const bool manual = GENERATE(true, false);
  RoutineWatch watch(kSettings);
  std::uint64_t period = 0;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    if (k == watch::WatchLimits::kRoutineSamples) {
      for (std::size_t i = 0; i < 10; ++i, ++period) {
        Cycle out = cycle_of(run, k, period);
        out.automatic = false;
        if (manual) watch.add(out);
      }
    }
    watch.add(cycle_of(run, k, period++));
  }
  CHECK(stiction_on(watch) == !manual);
}

TEST_CASE(
    "specialists that see no fault outweigh weak routine evidence, those that agree add to it",
    "[routine]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  const auto sum_with = [&](double probability) {
    RoutineWatch watch(kSettings);
    WindowJudgement judgement;
    judgement.probability[index_of(AlarmKind::stiction)] = probability;
    for (std::size_t k = 0; k < run.pv.size(); ++k) {
      if (k % 48 == 0 && probability >= 0.0) watch.specialists(judgement);
      if (watch.add(cycle_of(run, k, k))) return watch.judgement().sum;
    }
    return -1.0;
  };
  const double alone = sum_with(-1.0);
  CHECK(sum_with(0.5) == Approx(alone));
  CHECK(sum_with(0.9) > alone + 0.5);
  CHECK(sum_with(0.02) == Approx(alone - watch::WatchLimits::kMostFromSpecialists).margin(0.1));
}

TEST_CASE("a condition from before a restart stays until a window contradicts it", "[routine]") {
  RoutineWatch watch(kSettings);
  watch.restore(AlarmKind::backlash, true, 3.0);
  CHECK(watch.conditions()[index_of(AlarmKind::backlash)].on);
  const auto run = disturbed(2 * watch::WatchLimits::kRoutineSamples);
  std::size_t k = 0;
  for (; k < run.pv.size(); ++k) {
    if (watch.add(cycle_of(run, k, k))) break;
    CHECK(watch.conditions()[index_of(AlarmKind::backlash)].on);
  }
  CHECK(k == watch::WatchLimits::kRoutineSamples - 1);
  CHECK_FALSE(watch.conditions()[index_of(AlarmKind::backlash)].on);
}

TEST_CASE("without specialists a loop has the alarms of routine evidence, with their reason",
          "[routine]") {
  const auto run = sticky(2 * watch::WatchLimits::kRoutineSamples);
  LoopMonitor monitor(kSettings, kAlarmRule, nullptr);
  LoopAlarms alarms{AlarmSettings{}};
  AlarmTransitions last;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    const MonitorStep step = monitor.add(cycle_of(run, k, k));
    if (!step.routine) continue;
    const AlarmTransitions changed =
        alarms.judged(static_cast<std::int64_t>(k), step.conditions, AlarmReason::routine);
    if (!changed.empty()) last = changed;
  }
  REQUIRE(last.view().size() >= 1);
  bool seen = false;
  for (const AlarmTransition& t : last.view()) {
    seen = seen || (t.kind == AlarmKind::stiction && t.to == AlarmState::unacknowledged &&
                    t.reason == AlarmReason::routine);
  }
  CHECK(seen);
  WindowSettings off = kSettings;
  off.routine = false;
  LoopMonitor quiet(off, kAlarmRule, nullptr);
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    CHECK_FALSE(quiet.add(cycle_of(run, k, k)).routine);
  }
}

}  // namespace
}  // namespace loopwarden::tests::routine_watch_test
