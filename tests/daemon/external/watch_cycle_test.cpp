// SPDX-License-Identifier: Apache-2.0
#include "daemon/external/watch_cycle.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "daemon/external/sampler.hpp"
#include "record/record_row.hpp"
#include "tests/support/fake_clock.hpp"
#include "tests/support/fake_source.hpp"

namespace loopwarden::daemon::external::watch_cycle_test {
namespace {

using control::Fault;
using control::Mode;
using hal::Quality;
using hal::Reason;
using tests::FakeSource;

constexpr std::int64_t kSecond = 1'000'000'000;

rt::LoopSettings settings() {
  rt::LoopSettings s;
  s.controller.pid.output_high = 100.0;
  s.pv_check = {.low = 0.0, .high = 40.0, .range_margin = 0.05, .max_age_s = 5.0};
  return s;
}

// A loop sampled each second.
struct Rig {
  explicit Rig(Wiring wiring = {.set_point = true,
                                .stem = true,
                                .mode = true,
                                .mode_values = {.automatic = {1.0, 3.0}, .manual = {0.0}}},
               const rt::LoopSettings& loop = settings())
      : cycle(0, loop, std::move(wiring), source, channels, events) {
    all_fresh();
  }

  void all_fresh() {
    hal::SourceInputs& in = source.inputs;
    FakeSource::set(in.process_variable, 20.0, now_ns);
    FakeSource::set(in.output, 50.0, now_ns);
    FakeSource::set(in.set_point, 21.0, now_ns);
    FakeSource::set(in.stem, 49.0, now_ns);
    FakeSource::set(in.mode, 1.0, now_ns);
  }
  // The source is alive without new values.
  void all_alive() {
    hal::SourceInputs& in = source.inputs;
    for (hal::SourceSample* value :
         {&in.process_variable, &in.output, &in.set_point, &in.stem, &in.mode}) {
      value->alive_ns = now_ns;
    }
  }
  const record::RecordRow& run(std::uint64_t missed = 0) {
    cycle.run({.now_ns = now_ns, .period_index = ++period}, missed);
    while (channels.records.try_pop(row)) {
    }
    record::RecordRow same;
    while (channels.watched.try_pop(same)) {
    }
    CHECK(same.period_index == row.period_index);
    return row;
  }
  Mode mode() const { return row.mode; }
  Fault fault() const { return row.fault; }
  Quality quality() const { return row.pv_quality; }
  Reason reason() const { return row.pv_reason; }

  std::int64_t now_ns = 100 * kSecond;
  std::uint64_t period = 0;
  FakeSource source;
  rt::LoopChannels channels{{.records = 64, .watched = 64}};
  base::SpscRing<rt::Event> events{64};
  record::RecordRow row;
  WatchCycle cycle;
};

}  // namespace

TEST_CASE("a watched loop leaves the same row as one that is controlled here", "[watch]") {
  Rig rig;
  rig.run();
  CHECK(rig.row.pv == 20.0);
  CHECK(rig.row.co == 50.0);
  CHECK(rig.row.sp == 21.0);
  CHECK(rig.row.stem == 49.0);
  CHECK(rig.mode() == Mode::automatic);
  CHECK(rig.fault() == Fault::none);
  CHECK(rig.quality() == Quality::good);
  CHECK(rig.row.flags == 0);
  CHECK(rig.channels.set_point_wanted == 21.0);
  FakeSource::set(rig.source.inputs.output, 100.0, rig.now_ns);
  CHECK(rig.run().flags == record::kAtHigh);
  CHECK(rig.run(2).flags == (record::kAtHigh | record::kLateCycle));
}

TEST_CASE("SP, CO and stem out of their range are not known", "[watch]") {
  constexpr double kMax = std::numeric_limits<float>::max();
  for (const double code : {kMax, -kMax, 1e38, -9999.0, 6553.5, 107.0, -7.0}) {
    INFO(code);
    Rig rig;
    hal::SourceInputs& in = rig.source.inputs;
    FakeSource::set(in.set_point, code, rig.now_ns);
    rig.run();
    CHECK(std::isnan(rig.row.sp));
    CHECK(rig.fault() == Fault::none);
    FakeSource::set(in.set_point, 41.0, rig.now_ns);  // within the margin
    FakeSource::set(in.stem, code, rig.now_ns);
    rig.run();
    CHECK(rig.row.sp == 41.0);
    CHECK(std::isnan(rig.row.stem));
    FakeSource::set(in.stem, -3.0, rig.now_ns);
    rt::Event event;
    while (rig.events.try_pop(event)) {
    }
    FakeSource::set(in.output, code, rig.now_ns);
    rig.run();
    CHECK(rig.row.stem == -3.0);
    CHECK(std::isnan(rig.row.co));
    CHECK(rig.row.flags == 0);
    CHECK(rig.fault() == Fault::output_unknown);
    CHECK_FALSE(rt::unpacked(rig.channels.availability.load()).output_known);
    REQUIRE(rig.events.try_pop(event));
    CHECK(static_cast<Reason>(event.b) == Reason::out_of_range);
    CHECK(std::isnan(event.value));
  }
}

TEST_CASE("a watched PV that repeats one value while CO moves is frozen", "[watch]") {
  const bool on_change = GENERATE(false, true);
  Rig rig;
  rt::LoopSettings with = settings();
  with.pv_check.frozen_after_s = 60.0;
  rt::SettingsOffer offer;
  offer.settings = with;
  offer.number = 1;
  rig.channels.settings.publish(offer);
  const auto step = [&](double co) {
    rig.now_ns += kSecond;
    if (on_change) {
      rig.all_alive();
    } else {
      rig.all_fresh();
    }
    FakeSource::set(rig.source.inputs.output, co, rig.now_ns);
    rig.run();
  };
  for (int i = 0; i < 200; ++i) step(50.0);
  CHECK(rig.fault() == Fault::none);
  for (int i = 0; i < 50; ++i) step(50.0 - i);
  CHECK(rig.fault() == Fault::none);
  for (int i = 0; i < 40; ++i) step(0.0);
  CHECK(rig.fault() == Fault::bad_pv);
  CHECK(rig.reason() == Reason::frozen);
  CHECK(rig.quality() == Quality::uncertain);
  CHECK(rig.row.pv == 20.0);  // for the record
  CHECK(rig.mode() == Mode::automatic);
  FakeSource::set(rig.source.inputs.process_variable, 20.5, rig.now_ns);
  rig.run();
  CHECK(rig.fault() == Fault::none);
}

TEST_CASE("the mode is the meaning of the other controller's number", "[watch]") {
  Rig rig;
  const auto mode_of = [&](double number) {
    FakeSource::set(rig.source.inputs.mode, number, rig.now_ns);
    rig.run();
    return rig.mode();
  };
  CHECK(mode_of(3.0) == Mode::automatic);
  CHECK(mode_of(0.0) == Mode::manual);
  CHECK(mode_of(2.0) == Mode::fallback);
  CHECK(rig.row.requested_mode == Mode::manual);
  CHECK(mode_of(1.0) == Mode::automatic);
  rig.source.inputs.mode.sample.quality = Quality::bad;
  rig.run();
  CHECK(rig.mode() == Mode::fallback);
  CHECK(rig.row.requested_mode == Mode::automatic);

  Rig without(Wiring{.set_point = true});
  without.run();
  CHECK(without.mode() == Mode::automatic);
}

TEST_CASE("a value of a source that sends on change is valid while the source lives", "[watch]") {
  Rig rig;
  rig.run();
  rig.now_ns += 60 * kSecond;
  rig.all_alive();
  rig.run();
  CHECK(rig.quality() == Quality::good);
  CHECK(rig.reason() == Reason::held);
  CHECK(rig.row.pv == 20.0);
  CHECK(rig.row.co == 50.0);
  CHECK(rig.row.sp == 21.0);
  CHECK(rig.row.age_ms == 60'000.0F);
  CHECK(rig.mode() == Mode::automatic);
  CHECK(rig.fault() == Fault::none);

  rig.now_ns += 6 * kSecond;  // and then it dies
  rig.run();
  CHECK(rig.quality() == Quality::bad);
  CHECK(rig.reason() == Reason::stale);
  CHECK(std::isnan(rig.row.pv));
  CHECK(std::isnan(rig.row.co));
  CHECK(std::isnan(rig.row.sp));
  CHECK(std::isnan(rig.row.stem));
  CHECK(rig.mode() == Mode::fallback);
  CHECK(rig.fault() == Fault::bad_pv);
  CHECK((rig.row.flags & record::kOutputLost) == 0);  // the loop sends no output that could be lost

  rig.all_fresh();
  rig.run();
  CHECK(rig.fault() == Fault::none);
  CHECK(rig.reason() == Reason::none);
}

TEST_CASE("a held PV is bad after max_held, though its source lives", "[watch]") {
  rt::LoopSettings limited = settings();
  limited.pv_check.max_held_s = 60.0;
  Rig rig({}, limited);
  rig.run();
  rig.now_ns += 60 * kSecond;
  rig.all_alive();
  rig.run();
  CHECK(rig.reason() == Reason::held);
  rig.now_ns += kSecond;
  rig.all_alive();
  rig.run();
  CHECK(rig.quality() == Quality::bad);
  CHECK(rig.reason() == Reason::stale);
  CHECK(rig.row.co == 50.0);  // a set point or an output may be constant for days
  FakeSource::set(rig.source.inputs.process_variable, 20.0, rig.now_ns);
  rig.run();
  CHECK(rig.quality() == Quality::good);
}

TEST_CASE("PV is checked, and an unknown CO is reported", "[watch]") {
  Rig rig;
  FakeSource::set(rig.source.inputs.process_variable, 43.0, rig.now_ns);
  rig.run();
  CHECK(rig.reason() == Reason::out_of_range);
  rig.all_fresh();
  rig.source.inputs.output.sample.quality = Quality::bad;
  rig.run();
  CHECK(rig.quality() == Quality::good);
  CHECK(std::isnan(rig.row.co));
  CHECK(rig.fault() == Fault::output_unknown);
  rig.all_fresh();
  rig.source.inputs.process_variable.sample.quality = Quality::uncertain;
  rig.source.inputs.process_variable.sample.reason = Reason::source;
  rig.run();
  CHECK(rig.quality() == Quality::uncertain);
  CHECK(rig.reason() == Reason::source);
}

TEST_CASE("values that are not wired are unknown", "[watch]") {
  Rig rig(Wiring{});
  rig.run();
  CHECK(std::isnan(rig.row.sp));
  CHECK(std::isnan(rig.row.stem));
  CHECK(rig.row.co == 50.0);
  CHECK(rig.channels.position_age_ms == -1.0F);
}

TEST_CASE("changes of fault and mode are reported once", "[watch]") {
  Rig rig;
  rig.run();
  rig.run();
  rt::Event event;
  REQUIRE(rig.events.try_pop(event));
  CHECK(event.code == rt::EventCode::mode_changed);
  CHECK_FALSE(rig.events.try_pop(event));
  rig.now_ns += 60 * kSecond;
  rig.run();
  rig.run();
  REQUIRE(rig.events.try_pop(event));
  CHECK(event.code == rt::EventCode::fault_changed);
  CHECK(event.b == static_cast<std::uint8_t>(Reason::stale));
}

TEST_CASE("a reload's checks are taken between two periods", "[watch]") {
  Rig rig;
  rt::LoopSettings wider = settings();
  wider.pv_check.max_age_s = 100.0;
  rig.channels.settings.publish({.settings = wider, .number = 7});
  rig.run();
  CHECK(rig.channels.settings_taken == 7);
  rt::LoopSettings in_force;
  REQUIRE(rig.channels.in_force.fetch(in_force));
  CHECK(in_force.pv_check.max_age_s == 100.0);
  rig.now_ns += 60 * kSecond;
  rig.run();
  CHECK(rig.quality() == Quality::good);
  rig.channels.settings.publish({.settings = settings(), .number = 8, .withdrawn = true});
  rig.run();
  CHECK(rig.channels.settings_taken == 7);
  CHECK(rig.quality() == Quality::good);
}

TEST_CASE("the sampler runs each loop in its own period and keeps its phase", "[watch]") {
  tests::FakeClock clock;
  Rig slow;
  Rig quick;
  Sampler sampler(clock);
  sampler.add(slow.cycle, 4 * kSecond);
  sampler.add(quick.cycle, kSecond);
  const auto rows = [](Rig& rig) {
    std::vector<std::uint64_t> periods;
    while (rig.channels.records.try_pop(rig.row)) periods.push_back(rig.row.period_index);
    return periods;
  };
  const std::int64_t start_ns = clock.now_ns();
  while (clock.now_ns() < start_ns + 8 * kSecond) clock.sleep_until_ns(sampler.round());
  CHECK(rows(slow) == std::vector<std::uint64_t>{0, 1});
  CHECK(rows(quick) == std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6, 7});
  CHECK((quick.row.flags & record::kLateCycle) == 0);
  clock.sleep_until_ns(start_ns + 11 * kSecond + kSecond / 2);
  const std::int64_t next_ns = sampler.round();
  CHECK(rows(quick) == std::vector<std::uint64_t>{11});
  CHECK((quick.row.flags & record::kLateCycle) != 0);
  CHECK(next_ns <= start_ns + 12 * kSecond);
}

}  // namespace loopwarden::daemon::external::watch_cycle_test
