// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/process_watch.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/support/property.hpp"

namespace process_watch_test {

namespace property = loopwarden::tests::property;

using namespace loopwarden;
using namespace loopwarden::alarm;
using control::Fault;
using control::Mode;

namespace {

constexpr double kPeriod_s = 0.1;
constexpr std::uint64_t kDelay = 100;   // cycles in 10 s
constexpr std::uint64_t kMinute = 600;  // cycles

ProcessCycle healthy() {
  return {.sp = 50.0,
          .pv = 50.0,
          .pv_good = true,
          .output_arrives = true,
          .mode = Mode::automatic,
          .requested_mode = Mode::automatic};
}

ProcessCycle with_bad_pv() {
  ProcessCycle cycle = healthy();
  cycle.pv_good = false;
  cycle.pv_bad = true;
  return cycle;
}

// A loop that has been healthy for a minute.
struct Loop {
  explicit Loop(NormalMode normal = NormalMode::automatic, bool run_first = true)
      : Loop(ProcessSettings{.normal_mode = normal, .limits = {}}, run_first) {}
  explicit Loop(const ProcessSettings& settings, bool run_first = true)
      : watch(kPeriod_s, settings) {
    if (run_first) run(healthy(), 600);
  }
  void run(ProcessCycle cycle, std::uint64_t cycles) {
    for (std::uint64_t i = 0; i < cycles; ++i) {
      cycle.period_index = next++;
      const ProcessChanges found = watch.add(cycle);
      for (const ProcessChange& change : found.view()) {
        changes.push_back({change.kind, change.on});
        began.push_back(change.began);
        at.push_back(cycle.period_index);
      }
    }
  }
  std::vector<ProcessChange> take() { return std::exchange(changes, {}); }

  ProcessWatch watch;
  std::uint64_t next = 1;
  std::vector<ProcessChange> changes;
  std::vector<std::uint64_t> at;
  std::vector<std::uint64_t> began;
};

using Changes = std::vector<ProcessChange>;

Changes came(AlarmKind kind) { return {{kind, true}}; }
Changes went(AlarmKind kind) { return {{kind, false}}; }

}  // namespace

TEST_CASE("a process alarm is raised after 10 s without a break, and clears after a minute",
          "[monitor]") {
  Loop loop;
  const std::uint64_t first = loop.next;
  loop.run(with_bad_pv(), kDelay);
  CHECK(loop.take().empty());  // the last of them is 9.9 s after the first
  loop.run(with_bad_pv(), 1);
  CHECK(loop.take() == came(AlarmKind::bad_pv));
  CHECK(loop.at.back() == first + kDelay);
  CHECK(loop.began.back() == first);
  loop.run(with_bad_pv(), 1000);
  loop.run(healthy(), kMinute);
  CHECK(loop.take().empty());
  loop.run(healthy(), 1);
  CHECK(loop.take() == went(AlarmKind::bad_pv));
}

TEST_CASE("a frozen PV raises bad_pv, whether the loop continues or not", "[monitor]") {
  ProcessCycle frozen = healthy();
  frozen.pv_good = false;
  frozen.pv_frozen = true;
  if (GENERATE(false, true)) {
    frozen.fault = Fault::bad_pv;
    frozen.mode = Mode::fallback;
  }
  Loop loop;
  loop.run(frozen, kDelay + 1);
  CHECK(loop.take().front() == ProcessChange{AlarmKind::bad_pv, true});
  loop.run(healthy(), 2 * kMinute);
  const Changes gone = loop.take();
  CHECK(std::find(gone.begin(), gone.end(), ProcessChange{AlarmKind::bad_pv, false}) != gone.end());
}

TEST_CASE("a condition or a pause of at most 10 s neither raises nor clears an alarm",
          "[monitor]") {
  Loop loop;
  for (int i = 0; i < 4; ++i) {
    loop.run(with_bad_pv(), kDelay);
    loop.run(healthy(), 1);
  }
  CHECK(loop.take().empty());
  loop.run(healthy(), kMinute);
  loop.run(with_bad_pv(), kDelay + 1);
  CHECK(loop.take() == came(AlarmKind::bad_pv));
  for (int i = 0; i < 20; ++i) {
    loop.run(healthy(), kDelay);
    loop.run(with_bad_pv(), 1);
  }
  CHECK(loop.take().empty());
}

TEST_CASE("the delay is in the loop's time, whatever its period and whatever cycles are missing",
          "[monitor]") {
  SECTION("a period longer than the delay takes a second cycle") {
    ProcessWatch slow(60.0, {.normal_mode = NormalMode::any, .limits = {}});
    ProcessCycle cycle = with_bad_pv();
    cycle.period_index = 1;
    CHECK(slow.add(cycle).view().empty());
    cycle.period_index = 2;
    CHECK(slow.add(cycle).view().size() == 1);
  }
  SECTION("cycles that the monitor did not see count as the one before them") {
    Loop loop;
    loop.run(with_bad_pv(), 1);
    loop.next += kDelay;
    loop.run(with_bad_pv(), 1);
    CHECK(loop.take() == came(AlarmKind::bad_pv));
  }
}

TEST_CASE("PV is bad in every mode and while the loop starts; an uncertain one if it is the fault",
          "[monitor]") {
  Loop loop(NormalMode::any, false);
  ProcessCycle cycle = with_bad_pv();
  SECTION("in manual, without a fault") { cycle.mode = cycle.requested_mode = Mode::manual; }
  SECTION("while the loop starts") {
    cycle.fault = Fault::starting;
    cycle.mode = Mode::fallback;
  }
  SECTION("uncertain, and not good enough for this loop") {
    cycle.pv_bad = false;
    cycle.fault = Fault::bad_pv;
  }
  loop.run(cycle, kDelay + 1);
  CHECK(loop.take() == came(AlarmKind::bad_pv));

  ProcessCycle uncertain = healthy();
  uncertain.pv_good = false;
  loop.run(uncertain, kMinute + 1);
  CHECK(loop.take() == went(AlarmKind::bad_pv));
}

TEST_CASE(
    "an output is lost after it was there, or if its absence keeps a loop with its PV from "
    "starting",
    "[monitor]") {
  ProcessCycle lost = healthy();
  lost.output_arrives = false;
  SECTION("after commands have arrived") {
    Loop loop(NormalMode::any);
    loop.run(lost, kDelay + 1);
    CHECK(loop.take() == came(AlarmKind::output_lost));
    loop.run(healthy(), kMinute + 1);
    CHECK(loop.take() == went(AlarmKind::output_lost));
  }
  SECTION("a loop that has not written yet has lost no output") {
    Loop loop(NormalMode::any, false);
    lost.mode = lost.requested_mode = Mode::manual;
    loop.run(lost, 10 * kDelay);
    CHECK(loop.take().empty());
  }
  SECTION("a loop that waits for its PV has no information about the output") {
    Loop loop(NormalMode::any, false);
    lost.fault = Fault::starting;
    lost.pv_good = false;
    loop.run(lost, 10 * kDelay);
    CHECK(loop.take().empty());
  }
  SECTION("a loop that starts with its PV waits for the device") {
    Loop loop(NormalMode::any, false);
    lost.fault = Fault::starting;
    loop.run(lost, kDelay + 1);
    CHECK(loop.take() == came(AlarmKind::output_lost));
  }
  SECTION("so does one that starts in manual, with or without a PV") {
    Loop loop(NormalMode::any, false);
    lost.fault = Fault::starting;
    lost.pv_good = false;
    lost.requested_mode = Mode::manual;
    loop.run(lost, kDelay + 1);
    CHECK(loop.take() == came(AlarmKind::output_lost));
  }
}

TEST_CASE("an unknown output is reported until it is known; a graver fault hides it", "[monitor]") {
  Loop loop(NormalMode::any);
  ProcessCycle cycle = healthy();
  cycle.fault = Fault::output_unknown;
  loop.run(cycle, kDelay + 1);
  CHECK(loop.take() == came(AlarmKind::output_unknown));
  cycle.fault = Fault::late_cycle;
  loop.run(cycle, 10 * kDelay);
  CHECK(loop.take().empty());
  loop.run(healthy(), kMinute + 1);
  CHECK(loop.take() == went(AlarmKind::output_unknown));
}

TEST_CASE("a cycle without information restarts the delay", "[monitor]") {
  Loop loop(NormalMode::any);
  ProcessCycle cycle = healthy();
  cycle.fault = Fault::output_unknown;
  loop.run(cycle, kDelay);
  cycle.fault = Fault::late_cycle;
  loop.run(cycle, 1);
  cycle.fault = Fault::output_unknown;
  loop.run(cycle, kDelay);
  CHECK(loop.take().empty());
  loop.run(cycle, 1);
  CHECK(loop.take() == came(AlarmKind::output_unknown));
}

TEST_CASE("a loop is out of its normal mode; fallback is never normal", "[monitor]") {
  const auto in = [](Mode mode) {
    ProcessCycle cycle = healthy();
    cycle.mode = mode;
    return cycle;
  };
  struct Case {
    NormalMode normal;
    Mode mode;
    bool told;
  };
  for (const Case& c :
       {Case{NormalMode::automatic, Mode::automatic, false},
        Case{NormalMode::automatic, Mode::manual, true},
        Case{NormalMode::automatic, Mode::fallback, true},
        Case{NormalMode::manual, Mode::automatic, true},
        Case{NormalMode::manual, Mode::manual, false},
        Case{NormalMode::manual, Mode::fallback, true},
        Case{NormalMode::any, Mode::automatic, false}, Case{NormalMode::any, Mode::manual, false},
        Case{NormalMode::any, Mode::fallback, false}}) {
    Loop loop(c.normal, false);
    loop.run(in(c.mode), kDelay + 1);
    CAPTURE(to_text(c.normal), control::to_text(c.mode));
    CHECK(loop.take() == (c.told ? came(AlarmKind::not_normal_mode) : Changes{}));
  }
}

TEST_CASE("a loop in manual is out of its mode once it was in automatic, or after a fault",
          "[monitor]") {
  ProcessCycle manual = healthy();
  manual.mode = manual.requested_mode = Mode::manual;
  Loop loop(NormalMode::automatic, false);
  SECTION("not before: it is not yet in service") {
    ProcessCycle starting = manual;
    starting.mode = Mode::fallback;
    starting.fault = Fault::starting;
    loop.run(starting, kDelay / 2);
    loop.run(manual, 100 * kDelay);
    CHECK(loop.take().empty());
  }
  SECTION("that was in automatic") {
    loop.run(healthy(), 1);
    loop.run(manual, kDelay + 1);
    CHECK(loop.take() == came(AlarmKind::not_normal_mode));
  }
  SECTION("that waits after a fault") {
    ProcessCycle fallback = manual;
    fallback.mode = Mode::fallback;
    fallback.fault = Fault::output_unknown;
    loop.run(fallback, 1);
    loop.run(manual, kDelay + 1);
    CHECK(loop.take() == came(AlarmKind::not_normal_mode));
  }
  SECTION("that was out of it before a restart") {
    loop.watch.restore(AlarmKind::not_normal_mode, true);
    loop.run(manual, 2 * kMinute);
    CHECK(loop.take().empty());
    loop.run(healthy(), kMinute + 1);
    CHECK(loop.take() == went(AlarmKind::not_normal_mode));
  }
}

TEST_CASE("several conditions of one cycle are reported together, each as a separate alarm",
          "[monitor]") {
  Loop loop;
  ProcessCycle dead = with_bad_pv();
  dead.output_arrives = false;
  dead.fault = Fault::output_lost;
  dead.mode = Mode::fallback;
  loop.run(dead, kDelay + 1);
  CHECK(loop.take() == Changes{{AlarmKind::bad_pv, true}, {AlarmKind::output_lost, true}});
}

TEST_CASE("a lost PV is no alarm of the mode, whose delay starts when PV is back", "[monitor]") {
  Loop loop;
  ProcessCycle lost = with_bad_pv();
  lost.fault = Fault::bad_pv;
  lost.mode = Mode::fallback;
  loop.run(lost, kDelay - 1);
  ProcessCycle back = healthy();
  back.fault = Fault::bad_pv;  // the loop waits for its recovery delay
  back.mode = Mode::fallback;
  loop.run(back, kDelay - 1);
  SECTION("the loop returns to automatic") {
    loop.run(healthy(), 2 * kDelay);
    CHECK(loop.take().empty());
  }
  SECTION("the loop waits in manual") {
    back.fault = Fault::none;
    back.mode = Mode::manual;
    loop.run(back, 2);
    CHECK(loop.take() == came(AlarmKind::not_normal_mode));
  }
}

TEST_CASE("a consequence does not outlast its alarm", "[monitor]") {
  Loop loop;
  ProcessCycle lost = healthy();
  lost.output_arrives = false;
  lost.fault = Fault::output_lost;
  lost.mode = Mode::fallback;
  loop.run(lost, kDelay + 1);
  CHECK(loop.take() == Changes{{AlarmKind::output_lost, true}, {AlarmKind::not_normal_mode, true}});
  // The loop waits for its recovery delay before it resumes.
  lost.output_arrives = true;
  loop.run(lost, 10);
  loop.run(healthy(), 1);
  CHECK(loop.take() == went(AlarmKind::not_normal_mode));
  loop.run(healthy(), kMinute);
  CHECK(loop.take() == went(AlarmKind::output_lost));
}

TEST_CASE("an alarm that was on before a restart is not raised again, and clears as usual",
          "[monitor]") {
  Loop loop(NormalMode::automatic, false);
  loop.watch.restore(AlarmKind::bad_pv, true);
  loop.watch.restore(AlarmKind::output_lost, true);
  // A loop that starts without its PV has no information about the output.
  ProcessCycle starting = with_bad_pv();
  starting.output_arrives = false;
  starting.fault = Fault::starting;
  loop.run(starting, 10 * kDelay);
  CHECK(loop.take().empty());
  loop.run(healthy(), kMinute + 1);
  CHECK(loop.take() == Changes{{AlarmKind::bad_pv, false}, {AlarmKind::output_lost, false}});
}

TEST_CASE("a limit is watched again as soon as PV is good, though bad_pv has not cleared yet",
          "[monitor][limits]") {
  ProcessSettings settings{.limits = {}};
  settings.at(AlarmKind::pv_high_high) = {.fitted = true, .on_delay_s = 2.0};
  settings.limits.at(AlarmKind::pv_high_high) = {90.0, 1.0};
  Loop loop(settings);
  loop.run(with_bad_pv(), kDelay + 1);
  CHECK(loop.take() == came(AlarmKind::bad_pv));
  ProcessCycle above = healthy();
  above.pv = 95.0;
  loop.run(above, 21);
  CHECK(loop.take() == came(AlarmKind::pv_high_high));
}

TEST_CASE("a condition that flaps a thousand times is one alarm with a count", "[monitor]") {
  struct Pace {
    std::uint64_t bad = 0, good = 0;  // cycles
  };
  for (const Pace pace : {Pace{20, 30}, Pace{90, 70}, Pace{1, 599}, Pace{100, 100}, Pace{300, 300},
                          Pace{600, 600}, Pace{100, 600}}) {
    CAPTURE(pace.bad, pace.good);
    Loop loop;
    for (int i = 0; i < 1000; ++i) {
      loop.run(with_bad_pv(), pace.bad);
      loop.run(healthy(), pace.good);
    }
    CHECK(loop.take() == came(AlarmKind::bad_pv));
    CHECK(loop.began == std::vector<std::uint64_t>{601});  // not when it was raised the fifth time
    CHECK(loop.watch.flaps(AlarmKind::bad_pv) == 1000);
    loop.run(healthy(), kMinute + 1);
    CHECK(loop.take() == went(AlarmKind::bad_pv));
    loop.run(with_bad_pv(), kDelay + 1);
    CHECK(loop.watch.flaps(AlarmKind::bad_pv) == 1);
  }
}

TEST_CASE("with an off-delay of minutes each time counts while the alarm is on", "[monitor]") {
  ProcessSettings settings{.limits = {}};
  settings.at(AlarmKind::bad_pv).off_delay_s = 180.0;
  Loop loop(settings);
  for (int i = 0; i < 3; ++i) {
    loop.run(with_bad_pv(), kDelay + 1);
    loop.run(healthy(), kMinute + kMinute / 2);
  }
  CHECK(loop.take() == came(AlarmKind::bad_pv));
  CHECK(loop.watch.flaps(AlarmKind::bad_pv) == 3);
  loop.run(healthy(), 3 * kMinute);
  CHECK(loop.take() == went(AlarmKind::bad_pv));
}

TEST_CASE("a device that flaps is one alarm, whatever the pace and the delays", "[monitor]") {
  property::for_all("flapping", 60, [] {
    ProcessSettings settings{.limits = {}};
    ProcessRule& rule = settings.at(AlarmKind::bad_pv);
    rule.on_delay_s = 0.1 * static_cast<double>(property::integer(0, 1200));
    rule.off_delay_s = 0.1 * static_cast<double>(property::integer(0, 1200));
    const auto off_delay = static_cast<std::uint64_t>(std::lround(10.0 * rule.off_delay_s));
    Loop loop(settings);
    for (int i = 0; i < 100; ++i) {
      loop.run(with_bad_pv(), static_cast<std::uint64_t>(property::integer(1, 3 * kDelay)));
      loop.run(healthy(), static_cast<std::uint64_t>(property::integer(1, kMinute)));
    }
    std::size_t times = 0;
    for (const ProcessChange& change : loop.take()) times += change.on ? 1 : 0;
    // With an off-delay that is shorter than the pause, the first occurrence may clear by itself.
    property::require(times == 1 || (times == 2 && off_delay < kMinute), "it is not one alarm");
    property::require(loop.watch.flaps(AlarmKind::bad_pv) == 100, "not each time was counted");
  });
}

TEST_CASE("noise around a limit is one alarm, and no alarm if its dead band covers it",
          "[monitor][limits]") {
  property::for_all("noise", 60, [] {
    ProcessSettings settings{.limits = {}};
    settings.at(AlarmKind::pv_high).fitted = true;
    settings.limits.at(AlarmKind::pv_high) = {80.0, property::number(0.1, 20.0)};
    const double band = settings.limits.at(AlarmKind::pv_high).dead_band;
    const double depth = property::number(0.0, 30.0);  // PV units inside the limit
    Loop loop(settings);
    ProcessCycle above = healthy();
    above.pv = 81.0;
    ProcessCycle below = healthy();
    below.pv = 80.0 - depth;
    for (int i = 0; i < 50; ++i) {
      loop.run(above, static_cast<std::uint64_t>(property::integer(1, 3 * kDelay)));
      loop.run(below, static_cast<std::uint64_t>(property::integer(10, kMinute)));
    }
    property::require(loop.take() == came(AlarmKind::pv_high), "it is not one alarm");
    const bool held = 80.0 - depth > 80.0 - band;
    property::require(loop.watch.flaps(AlarmKind::pv_high) == (held ? 1 : 50),
                      "the dead band holds what is inside it, and no more");
  });
}

TEST_CASE("an alarm lasts at least as long as its condition and off-delay", "[monitor]") {
  property::for_all("delays", 100, [] {
    ProcessSettings settings{.normal_mode = NormalMode::any, .limits = {}};
    ProcessRule& rule = settings.at(AlarmKind::bad_pv);
    rule.on_delay_s = 0.1 * static_cast<double>(property::integer(0, 300));
    rule.off_delay_s = 0.1 * static_cast<double>(property::integer(0, 300));
    Loop loop(settings);
    const auto on = static_cast<std::uint64_t>(property::integer(1, 600));
    const auto on_delay = static_cast<std::uint64_t>(std::lround(10.0 * rule.on_delay_s));
    const auto off_delay = static_cast<std::uint64_t>(std::lround(10.0 * rule.off_delay_s));
    const std::uint64_t first = loop.next;
    loop.run(with_bad_pv(), on);
    loop.run(healthy(), 400);
    const bool outlasts = on > on_delay;
    property::require(loop.at.size() == (outlasts ? 2 : 0), "raised or not according to its delay");
    if (!outlasts) return;
    property::require(loop.at[0] == first + on_delay, "raised with its on-delay");
    property::require(loop.at[1] == first + on + off_delay, "cleared with its off-delay");
  });
}

TEST_CASE("an open enable contact and a silent source are separate alarms", "[monitor]") {
  ProcessSettings settings{.normal_mode = NormalMode::any, .limits = {}};
  settings.at(AlarmKind::enable_open).fitted = settings.at(AlarmKind::source_lost).fitted = true;
  Loop loop(settings);
  ProcessCycle cycle = healthy();
  cycle.fault = Fault::enable_open;
  loop.run(cycle, kDelay + 1);
  CHECK(loop.take() == came(AlarmKind::enable_open));
  // While the daemon ends, the contact is unknown.
  cycle.fault = Fault::stop;
  loop.run(cycle, 2 * kDelay);
  CHECK(loop.take().empty());
  loop.run(healthy(), kMinute + 1);
  CHECK(loop.take() == went(AlarmKind::enable_open));
  ProcessCycle silent = with_bad_pv();
  silent.pv_silent = true;
  loop.run(silent, kDelay + 1);
  CHECK(loop.take() == Changes{{AlarmKind::bad_pv, true}, {AlarmKind::source_lost, true}});
}

TEST_CASE("a watched loop has 30 s for its first PV", "[monitor]") {
  ProcessSettings settings{.limits = {}};
  settings.at(AlarmKind::source_lost).fitted = true;
  Loop loop(settings, false);
  ProcessCycle awaited = with_bad_pv();
  awaited.pv_silent = awaited.pv_awaited = true;
  awaited.mode = Mode::fallback;
  loop.run(awaited, 299 + kDelay);
  CHECK(loop.take().empty());
  SECTION("then it has lost its source") {
    loop.run(awaited, 2);
    CHECK(loop.take() == Changes{{AlarmKind::bad_pv, true}, {AlarmKind::source_lost, true}});
  }
  SECTION("a first PV ends the wait") {
    loop.run(healthy(), 1);
    loop.run(with_bad_pv(), kDelay + 1);
    CHECK(loop.take() == came(AlarmKind::bad_pv));
  }
}

TEST_CASE("without a limit in the loop's file there is no limit alarm", "[monitor]") {
  Loop loop;
  ProcessCycle cycle = healthy();
  cycle.pv = 1e6;
  loop.run(cycle, 100 * kDelay);
  CHECK(loop.take().empty());
}

TEST_CASE("an effect of a loop test raises no alarm, unless it lasts", "[monitor]") {
  Loop loop;
  ProcessCycle silent = healthy();
  silent.out_of_service = true;
  silent.output_arrives = false;
  silent.fault = Fault::output_unknown;
  silent.mode = Mode::fallback;
  silent.requested_mode = Mode::manual;
  loop.run(silent, 10 * kMinute);
  CHECK(loop.take().empty());
  SECTION("no condition is left") {
    loop.run(healthy(), 10 * kMinute);
    CHECK(loop.take().empty());
  }
  SECTION("it lasts: the delay begins with the end of the test") {
    silent.out_of_service = false;
    loop.run(silent, kDelay);
    CHECK(loop.take().empty());
    loop.run(silent, 1);
    CHECK(loop.take().size() == 3);
  }
  SECTION("PV is watched all the while") {
    ProcessCycle cycle = with_bad_pv();
    cycle.out_of_service = true;
    loop.run(cycle, kDelay + 1);
    CHECK(loop.take() == Changes{{AlarmKind::bad_pv, true}});
  }
}

TEST_CASE("a loop that was in automatic only for its test is not out of its mode", "[monitor]") {
  Loop loop(NormalMode::automatic, false);
  ProcessCycle cycle = healthy();
  cycle.out_of_service = true;
  loop.run(cycle, kMinute);
  cycle = healthy();
  cycle.mode = cycle.requested_mode = Mode::manual;
  loop.run(cycle, 10 * kMinute);
  CHECK(loop.take().empty());
}

}  // namespace process_watch_test
