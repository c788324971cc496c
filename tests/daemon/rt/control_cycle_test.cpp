// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/control_cycle.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/effects/backlash/backlash.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"

namespace loopwarden::tests::control_cycle_test {
namespace {

using control::Fault;
using control::Mode;
using control::OutputAction;
using daemon::rt::Command;
using daemon::rt::Event;
using daemon::rt::EventCode;
using daemon::rt::JacketMode;
using daemon::rt::LoopSettings;
using daemon::rt::MovesMode;
using daemon::rt::Refusal;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST_CASE("the loop starts from the read-back, not from the configured output") {
  Loop loop;
  loop.io.set_read_back(63.0);
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.io.written == Approx(63.0));
}

TEST_CASE("taking over the valve's position is no movement that PV would have to answer") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.pv_check.frozen_after_s = 0.8;
  Loop loop(settings);
  loop.io.set_read_back(63.0);
  loop.run(30);  // at its set point, PV repeats the same number
  CHECK(loop.io.written == Approx(63.0));
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.row.pv_reason == hal::Reason::none);
}

TEST_CASE("a frozen PV is an alarm; it moves the valve only if the file has frozen_after") {
  const bool acts = GENERATE(false, true);
  daemon::rt::LoopSettings settings = plain_settings();
  settings.pv_check.frozen_after_s = 2.0;
  settings.pv_check.frozen_acts = acts;
  settings.controller.output.rate_per_s = 1000.0;
  Loop loop(settings);
  loop.io.set_read_back(63.0);
  loop.run(1);
  const double span = settings.pv_check.high - settings.pv_check.low;
  loop.io.set_pv(settings.pv_check.low + 0.3 * span);
  double lowest = loop.row.co;
  double highest = loop.row.co;
  bool frozen = false;
  for (int i = 0; i < 2000 && !frozen; ++i) {
    loop.run(1);
    lowest = std::min(lowest, loop.row.co);
    highest = std::max(highest, loop.row.co);
    frozen = loop.row.pv_reason == hal::Reason::frozen;
    if (!frozen) CHECK(loop.fault() == Fault::none);
  }
  REQUIRE(frozen);
  CHECK(highest - lowest >= 10.0);
  CHECK(loop.row.pv_quality == hal::Quality::uncertain);
  loop.run(100);
  CHECK(loop.fault() == (acts ? Fault::bad_pv : Fault::none));
  CHECK(loop.mode() == (acts ? Mode::fallback : Mode::automatic));
}

TEST_CASE("a read-back out of its range is not known") {
  const double code = GENERATE(3.4e38, -9999.0, 6553.5, 106.0);
  Loop loop(plain_settings(), {.mode = Mode::automatic, .set_point = 50.0, .output = {}});
  loop.io.set_read_back(code);
  loop.run(5);
  CHECK(loop.fault() == Fault::output_unknown);
  CHECK(std::isnan(loop.row.stem));
  CHECK(std::isnan(loop.row.co));
  loop.io.set_read_back(-1.0);
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.row.stem == -1.0);
}

TEST_CASE("a PV at the end of its transmitter's range is good, and this is reported") {
  Loop loop;
  const auto limit = [&] { return loop.run(1).pv_limit; };
  CHECK(limit() == hal::Limit::none);
  loop.io.inputs.process_variable.limit = hal::Limit::high;
  CHECK(limit() == hal::Limit::high);
  CHECK(loop.row.pv_quality == hal::Quality::good);
  loop.io.inputs.process_variable.limit = hal::Limit::low;
  CHECK(limit() == hal::Limit::low);
  // A value that can't be trusted is at no limit.
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::sensor_failure);
  CHECK(limit() == hal::Limit::none);
}

TEST_CASE("without a read-back the loop starts from the configured output") {
  Loop loop;
  loop.run(1);
  CHECK(loop.io.written == Approx(40.0));
}

TEST_CASE("no output is written before the first good PV") {
  Loop loop;
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::never_received);
  loop.run(50);
  CHECK(loop.fault() == Fault::starting);
  CHECK_FALSE(loop.io.last.write);
  CHECK(loop.io.written == -1.0);
  loop.io.set_pv(50.0);
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.io.written == Approx(40.0));
}

TEST_CASE(
    "a late cycle or an open contact before the first good PV writes no output that the file "
    "states") {
  Loop loop;
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::never_received);
  loop.run(5);
  loop.run(1, 50);
  loop.run(5);
  CHECK(loop.fault() == Fault::starting);
  CHECK(loop.io.written == -1.0);
  loop.io.inputs.enable = hal::Enable::open;
  loop.run(5);
  CHECK(loop.fault() == Fault::enable_open);
  CHECK(loop.io.written == -1.0);
  loop.io.inputs.enable = hal::Enable::closed;
  loop.io.set_pv(50.0);
  loop.run(10);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.io.last.write);
}

TEST_CASE("after a first command the loop keeps sending, so that the device's watchdog is fed") {
  Loop loop;
  loop.io.set_read_back(20.0);
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::never_received);
  loop.io.inputs.enable = hal::Enable::open;
  loop.run(30);
  REQUIRE(loop.io.last.write);
  REQUIRE(loop.io.written == Approx(0.0));
  loop.io.inputs.enable = hal::Enable::closed;
  loop.io.set_read_back(0.4);  // within its error
  loop.run(30);
  CHECK(loop.fault() == Fault::starting);
  CHECK(loop.io.last.write);
  CHECK(loop.io.written == Approx(0.0));
}

TEST_CASE(
    "with an unknown output the loop waits in manual for the operator, and refuses automatic") {
  Loop loop(plain_settings(),
            {.mode = Mode::manual, .set_point = 50.0, .output = OutputAction::hold()});
  loop.run(10);
  CHECK(loop.fault() == Fault::output_unknown);
  CHECK_FALSE(loop.io.last.write);
  loop.order({.mode = Mode::automatic});
  loop.run(1);
  CHECK(loop.answer() == Refusal::output_unknown);
  CHECK(loop.row.requested_mode == Mode::manual);
  const auto events = loop.take_events();
  CHECK(std::any_of(events.begin(), events.end(),
                    [](const auto& e) { return e.code == EventCode::command_refused; }));
  loop.order({.output = 30.0});
  loop.run(1);
  CHECK(loop.io.written == Approx(30.0));
  loop.order({.mode = Mode::automatic});
  loop.run(1);
  CHECK(loop.mode() == Mode::automatic);
}

TEST_CASE("a loop whose output is unknown does not look as if it ran") {
  const Mode mode = GENERATE(Mode::automatic, Mode::manual);
  Loop loop(plain_settings(), {.mode = mode, .set_point = 80.0, .output = OutputAction::hold()});
  for (int i = 0; i < 50; ++i) {
    loop.run(1);
    REQUIRE_FALSE(loop.io.last.write);
    REQUIRE(loop.io.last.alarm);
    REQUIRE(loop.fault() == Fault::output_unknown);
    REQUIRE(loop.mode() == Mode::fallback);
    REQUIRE(loop.row.requested_mode == mode);
    REQUIRE(std::isnan(loop.row.co));  // no command was sent
    REQUIRE(std::isnan(loop.row.calculated));
    REQUIRE(loop.row.flags == 0);  // an unknown output is at no limit
    REQUIRE(loop.row.jacket_rate == 0.0F);
  }
  CHECK(loop.io.written == -1.0);
  const auto events = loop.take_events();
  CHECK(std::none_of(events.begin(), events.end(),
                     [](const auto& e) { return std::isfinite(e.value) && e.value != 0.0; }));

  // The integral has not wound up: the law starts from the operator's value, though SP was 30 off
  // for 5 s.
  loop.order({.mode = Mode::manual, .output = 30.0});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::manual);
  CHECK(loop.io.written == 30.0);
  CHECK(loop.row.co == 30.0);
  loop.order({.mode = Mode::automatic, .set_point = 50.0});
  loop.run(1);
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.io.written == Approx(30.0));
}

TEST_CASE("after a late read-back the loop resumes in its previous mode, without a bump") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.safety.recovery = control::Recovery::manual;
  Loop loop(settings, {.mode = Mode::automatic, .set_point = 50.0, .output = OutputAction::hold()});
  loop.io.set_read_back(63.0);
  loop.io.inputs.valve_position.quality = hal::Quality::bad;
  loop.run(20);
  CHECK(loop.fault() == Fault::output_unknown);
  loop.io.set_read_back(63.0);
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.io.written == Approx(63.0));
}

TEST_CASE("a read-back that is good from the start shows no fault on the way") {
  Loop loop(plain_settings(),
            {.mode = Mode::automatic, .set_point = 50.0, .output = OutputAction::hold()});
  loop.io.set_read_back(63.0);
  loop.run(5);
  const auto events = loop.take_events();
  CHECK(std::none_of(events.begin(), events.end(), [](const auto& e) {
    return e.code == EventCode::fault_changed && e.a != static_cast<std::uint8_t>(Fault::none);
  }));
}

TEST_CASE("while the loop doesn't write it follows the valve that others move") {
  Loop loop;
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::never_received);
  loop.io.set_read_back(63.0);
  loop.run(5);
  CHECK(loop.fault() == Fault::starting);
  CHECK(loop.row.co == 63.0);
  loop.io.set_read_back(20.0);  // manually, on the positioner
  loop.run(1);
  CHECK(loop.row.co == 20.0);
  loop.io.set_pv(50.0);
  loop.run(1);
  CHECK(loop.io.written == Approx(20.0));
}

TEST_CASE("an output that the file states has not been sent before the first command") {
  Loop loop;
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::never_received);
  loop.run(5);
  CHECK(loop.fault() == Fault::starting);
  CHECK(std::isnan(loop.row.co));
  loop.io.set_pv(50.0);
  loop.run(1);
  CHECK(loop.row.co == Approx(40.0));
  CHECK(loop.io.written == Approx(40.0));
}

TEST_CASE("from beyond its limits the output returns at the rate limit, from the first command") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.controller.output.high = 60.0;
  Loop loop(settings);
  loop.io.set_read_back(90.0);  // moved manually
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.io.written == Approx(85.0));
  loop.run(1);
  CHECK(loop.io.written == Approx(80.0));
}

TEST_CASE("a loop whose read-back died with its output is freed by a command for the output") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.safety.on_output_lost = GENERATE(OutputAction::hold(), OutputAction::go_to(70.0));
  settings.safety.recovery = control::Recovery::manual;
  Loop loop(settings);
  loop.io.set_read_back(40.0);
  loop.run(10);
  // Like a device that returns without its position sensor: good again with the first command that
  // it takes.
  loop.io.inputs.output_ok = false;
  loop.io.inputs.output_reason = hal::Reason::link_lost;
  loop.io.inputs.valve_position.quality = hal::Quality::bad;
  loop.run(50);
  CHECK(loop.fault() == Fault::output_lost);
  CHECK_FALSE(loop.io.last.write);
  CHECK(std::isnan(loop.row.co));
  CHECK_FALSE(daemon::rt::unpacked(loop.channels.availability.load()).output_known);
  loop.order({.mode = Mode::manual, .output = 25.0});
  for (int i = 0; i < 5; ++i) {
    loop.run(1);
    CHECK(loop.answer() == Refusal::none);
    CHECK(loop.io.last.write);
    CHECK(loop.io.written == 25.0);
  }
  loop.io.inputs.output_ok = true;
  loop.run(10);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::manual);
  CHECK(loop.io.written == 25.0);

  // The operator's value is valid until the output is lost again.
  loop.io.inputs.output_ok = false;
  loop.run(2);
  CHECK_FALSE(loop.io.last.write);
  CHECK(loop.fault() == Fault::output_lost);
}

TEST_CASE("a reported output is valid until the next loss, also within the fault's recovery") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.safety.recovery_delay_s = 2.0;
  Loop loop(settings);
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.inputs.output_ok = false;
  loop.io.inputs.output_reason = hal::Reason::link_lost;
  loop.io.inputs.valve_position.quality = hal::Quality::bad;
  loop.run(10);
  loop.order({.mode = Mode::manual, .output = 25.0});
  loop.run(2);
  loop.io.inputs.output_ok = true;
  loop.run(5);
  REQUIRE(loop.fault() == Fault::output_lost);
  REQUIRE(loop.io.written == 25.0);
  // Lost once more; the device's watchdog moves the valve.
  loop.io.inputs.output_ok = false;
  loop.run(20);
  loop.io.inputs.output_ok = true;
  loop.io.set_read_back(90.0);
  loop.run(1);
  CHECK(loop.io.written == Approx(90.0));
}

TEST_CASE("the value that the fault's action started from is not used for the next fault") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.safety.on_output_lost = OutputAction::go_to(70.0);
  Loop loop(settings, {.mode = Mode::manual, .set_point = 50.0, .output = OutputAction::hold()});
  loop.order({.output = 25.0});
  loop.run(5);
  CHECK(loop.io.written == 25.0);
  loop.io.inputs.output_ok = false;
  loop.io.inputs.output_reason = hal::Reason::link_lost;
  loop.run(30);
  CHECK(loop.io.written == Approx(70.0));
}

TEST_CASE("after a pause without a good read-back the loop waits, and reports this") {
  Loop loop;
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.inputs.valve_position.quality = hal::Quality::bad;
  loop.run(1, 50);
  loop.run(10);
  CHECK(loop.fault() == Fault::output_unknown);
  CHECK(std::isnan(loop.row.co));
  loop.io.set_read_back(5.0);
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.io.written == Approx(5.0));
}

TEST_CASE("the stop action of an unknown output is applied at once, without a guessed start") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.safety.on_stop = OutputAction::go_to(80.0);
  Loop loop(settings, {.mode = Mode::manual, .set_point = 50.0, .output = OutputAction::hold()});
  loop.run(5);
  loop.run(1, 0, true);
  CHECK(loop.io.written == 80.0);
  CHECK(loop.row.co == 80.0);
  CHECK(loop.channels.stop_reached.load());
}

TEST_CASE("a stop after a pause begins at the valve's position, whichever cycle sees the two") {
  Loop loop;  // stop value 5, 5 a cycle
  loop.io.set_read_back(90.0);
  loop.order({.mode = Mode::manual, .output = 90.0});
  loop.run(10);
  REQUIRE(loop.io.written == Approx(90.0));
  const double old = loop.io.written;
  SECTION("both in one") {
    loop.io.set_read_back(0.0);
    loop.run(1, 50, true);
    CHECK(loop.io.written == Approx(5.0));
  }
  SECTION("the pause first, and the read-back after the stop") {
    loop.io.inputs.valve_position.time_ns = 0;
    loop.io.inputs.valve_position.quality = hal::Quality::bad;
    loop.run(1, 50);
    loop.run(1, 0, true);
    CHECK_FALSE(loop.io.last.write);
    CHECK(loop.io.written == old);
    CHECK_FALSE(loop.channels.stop_reached.load());
    loop.io.set_read_back(60.0);
    loop.run(1, 0, true);
    CHECK(loop.io.written == Approx(55.0));
  }
  SECTION("no read-back arrives") {
    loop.io.inputs.valve_position.quality = hal::Quality::bad;
    loop.run(1, 50);
    loop.run(10, 0, true);
    CHECK(loop.io.written == Approx(5.0));
    CHECK(loop.channels.stop_reached.load());
  }
}

TEST_CASE("a command can't expect a value of an unknown output") {
  Loop loop(plain_settings(),
            {.mode = Mode::manual, .set_point = 50.0, .output = OutputAction::hold()});
  loop.run(5);
  loop.order({.output = 30.0, .expected = {.output = 0.0}});
  loop.run(1);
  CHECK(loop.answer() == Refusal::output_changed);
  CHECK_FALSE(loop.io.last.write);
  loop.order({.output = 30.0, .expected = {.output = daemon::rt::kOutputNotKnown}});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.io.written == 30.0);
  loop.order({.output = 45.0, .expected = {.output = daemon::rt::kOutputNotKnown}});
  loop.run(1);
  CHECK(loop.answer() == Refusal::output_changed);
  CHECK(loop.io.written == 30.0);
}

TEST_CASE(
    "a bad PV holds the output first, then sends it to the configured value at the rate limit") {
  Loop loop;
  loop.run(20);
  const double before = loop.io.written;
  loop.io.set_pv(50.0, hal::Quality::bad, hal::Reason::sensor_failure);
  loop.run(10);  // held for 1 s
  CHECK(loop.fault() == Fault::bad_pv);
  CHECK(loop.io.written == before);
  loop.run(1);
  CHECK(loop.io.written == Approx(before - 5.0));  // 50 CO units/s over 0.1 s
  loop.run(20);
  CHECK(loop.io.written == Approx(10.0));
}

TEST_CASE("a PV that grows old counts as bad") {
  Loop loop;
  loop.run(5);
  loop.io.fresh = false;
  loop.run(3);
  CHECK(loop.fault() == Fault::none);
  loop.run(1);
  CHECK(loop.fault() == Fault::bad_pv);
  CHECK(loop.row.pv_reason == hal::Reason::stale);
}

TEST_CASE("a PV that is no number never reaches the output") {
  Loop loop;
  loop.run(5);
  loop.io.set_pv(kNaN);
  loop.run(30);
  CHECK(loop.fault() == Fault::bad_pv);
  CHECK(loop.io.written == Approx(10.0));
}

TEST_CASE("recovery from a bad PV is bumpless and waits for the delay") {
  Loop loop;
  loop.run(5);
  loop.io.set_pv(50.0, hal::Quality::bad, hal::Reason::sensor_failure);
  loop.run(40);
  CHECK(loop.io.written == Approx(10.0));
  loop.io.set_pv(50.0);
  loop.run(4);
  CHECK(loop.fault() == Fault::bad_pv);  // 0.4 s of 0.5 s
  loop.run(1);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.io.written == Approx(10.0));  // error is zero: no step at all
}

TEST_CASE("with recovery to manual the loop waits for the operator") {
  auto settings = plain_settings();
  settings.safety.recovery = control::Recovery::manual;
  Loop loop(settings);
  loop.run(5);
  loop.io.set_pv(50.0, hal::Quality::bad, hal::Reason::sensor_failure);
  loop.run(5);
  loop.io.set_pv(70.0);
  loop.run(50);
  CHECK(loop.mode() == Mode::manual);
  CHECK(loop.io.written == Approx(40.0));
}

TEST_CASE("in manual a dead transmitter leaves the valve to the operator") {
  Loop loop;
  loop.order({.mode = Mode::manual});
  loop.run(3);
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::sensor_failure);
  loop.run(30);
  CHECK(loop.fault() == Fault::none);
  loop.order({.output = 45.0});
  loop.run(1);
  CHECK(loop.io.written == Approx(45.0));
  CHECK(std::isfinite(loop.row.sp));
}

TEST_CASE(
    "while commands don't reach the valve the loop follows its read-back and returns without a "
    "bump") {
  Loop loop;
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.inputs.output_ok = false;
  loop.io.inputs.output_reason = hal::Reason::link_lost;
  loop.io.set_read_back(12.0);  // the device's own watchdog has moved it
  loop.run(5);
  CHECK(loop.fault() == Fault::output_lost);
  loop.io.inputs.output_ok = true;
  loop.run(10);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.io.written == Approx(12.0).margin(0.01));
}

TEST_CASE(
    "after a lost output the loop writes only after a fresh read-back of the valve's position") {
  Loop loop;
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.inputs.output_ok = false;
  loop.io.inputs.output_reason = hal::Reason::link_lost;
  loop.io.inputs.valve_position.quality = hal::Quality::bad;
  loop.run(5);
  CHECK(loop.fault() == Fault::output_lost);
  CHECK_FALSE(loop.io.last.write);
  loop.io.set_read_back(12.0);
  loop.run(1);
  CHECK(loop.io.last.write);
  CHECK(loop.io.written == Approx(12.0));
}

TEST_CASE("after a pause of the process an old read-back does not count") {
  Loop loop;
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.fresh = false;
  loop.run(1, 50);  // stopped for five seconds; the samples are from before
  CHECK(loop.fault() == Fault::late_cycle);
  CHECK_FALSE(loop.io.last.write);
  loop.io.fresh = true;
  loop.io.set_read_back(5.0);
  loop.run(1);
  CHECK(loop.io.written == Approx(5.0));
  loop.run(10);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.io.written == Approx(5.0));
}

TEST_CASE("a read-back from before the pause does not count, however long a sample may be old") {
  daemon::rt::LoopSettings settings = plain_settings();
  settings.pv_check.max_age_s = 60.0;
  Loop loop(settings);
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.fresh = false;
  loop.run(1, 50);  // the device's own watchdog has acted meanwhile
  CHECK_FALSE(loop.io.last.write);
  loop.run(3);
  CHECK_FALSE(loop.io.last.write);
  loop.io.fresh = true;
  loop.io.set_read_back(5.0);
  loop.run(1);
  CHECK(loop.io.last.write);
  CHECK(loop.io.written == Approx(5.0));
}

TEST_CASE("the valve's position after a loss is also learnt under a graver fault") {
  Loop loop;
  loop.io.set_read_back(40.0);
  loop.run(10);
  loop.io.inputs.enable = hal::Enable::open;  // to 0 at 5 a period
  loop.io.inputs.output_ok = false;
  loop.io.inputs.output_reason = hal::Reason::link_lost;
  loop.io.set_read_back(90.0);
  loop.run(2);
  CHECK(loop.fault() == Fault::enable_open);
  CHECK(loop.io.written == Approx(85.0));
}

TEST_CASE("an open enable contact has priority over everything except stop") {
  Loop loop;
  loop.run(5);
  loop.io.inputs.enable = hal::Enable::open;
  loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::sensor_failure);
  loop.run(20);
  CHECK(loop.fault() == Fault::enable_open);
  CHECK(loop.io.written == Approx(0.0));
  CHECK(loop.io.last.alarm);
}

TEST_CASE(
    "stop drives the output to its stop action within the rate limit and reports its arrival") {
  Loop loop;
  loop.run(5);
  CHECK(loop.io.written == Approx(40.0));
  loop.run(1, 0, true);
  CHECK(loop.io.written == Approx(35.0));
  CHECK_FALSE(loop.channels.stop_reached.load());
  loop.run(6, 0, true);
  CHECK(loop.io.written == Approx(5.0));
  CHECK(loop.channels.stop_reached.load());
}

TEST_CASE("the stop action is written even if the output was never known") {
  Loop loop(plain_settings(),
            {.mode = Mode::manual, .set_point = 50.0, .output = OutputAction::hold()});
  loop.run(2);
  loop.run(5, 0, true);
  CHECK(loop.io.written == Approx(5.0));
}

TEST_CASE("a late cycle has its own action, and ends when cycles are in time again") {
  auto settings = plain_settings();
  settings.safety.on_late_cycle = OutputAction::go_to(20.0);
  settings.safety.late_cycle_periods = 3;
  Loop loop(settings);
  loop.run(5);
  loop.run(1, 3);
  CHECK(loop.fault() == Fault::none);  // three missed are still accepted
  loop.run(1, 4);
  CHECK(loop.fault() == Fault::late_cycle);
  loop.run(5);
  CHECK(loop.fault() == Fault::none);
}

TEST_CASE("a controller result that is no number is not written and ends in its own action") {
  auto settings = plain_settings();
  settings.safety.on_not_finite = OutputAction::go_to(30.0);
  Loop loop(settings);
  loop.run(5);
  auto poisoned = settings;
  poisoned.controller.pid.gains.kp = kNaN;
  loop.channels.settings.publish({poisoned, 1});
  loop.run(1);
  CHECK(loop.io.written == Approx(40.0));
  CHECK(std::isfinite(loop.io.last.output));
  loop.run(10);
  CHECK(loop.io.written == Approx(30.0));
  CHECK(loop.fault() == Fault::not_finite);
}

TEST_CASE("every output ever written is inside the limits and within the rate") {
  Loop loop;
  double last = 40.0;
  for (int i = 0; i < 4000; ++i) {
    // PV, quality, enable and set point change wildly, at fixed pseudo-random moments.
    const int dice = (i * 7919) % 97;
    if (dice < 5) loop.io.set_pv(dice * 30.0 - 20.0);
    if (dice == 20) loop.io.set_pv(kNaN);
    if (dice == 30) loop.io.set_pv(40.0, hal::Quality::bad, hal::Reason::link_lost);
    if (dice == 40) loop.order({.set_point = (i % 11) * 10.0});
    if (dice == 50) loop.order({.mode = Mode::manual});
    if (dice == 51) loop.order({.output = (i % 13) * 20.0 - 50.0});
    if (dice == 60) loop.order({.mode = Mode::automatic});
    loop.io.inputs.enable = dice > 90 ? hal::Enable::open : hal::Enable::closed;
    loop.run(1);
    if (!loop.io.last.write) continue;
    REQUIRE(loop.io.last.output >= 0.0);
    REQUIRE(loop.io.last.output <= 100.0);
    REQUIRE(std::abs(loop.io.last.output - last) <= 5.0 + 1e-9);
    last = loop.io.last.output;
  }
  CHECK(last != 40.0);
}

TEST_CASE("anti-windup refers to the output that the device really applied") {
  // The device stops at 60; the loop requests more and more.
  Loop loop;
  loop.io.device = [](double output) { return std::min(output, 60.0); };
  loop.io.set_pv(30.0);
  loop.run(300);
  CHECK(loop.row.co == Approx(60.0));
  loop.io.set_pv(70.0);  // error of the other sign: the output must fall at once
  loop.run(2);
  CHECK(loop.row.co < 60.0);
}

TEST_CASE("new settings are applied whole and without a bump") {
  Loop loop;
  loop.io.set_pv(48.0);
  loop.run(30);
  const double before = loop.io.written;
  auto settings = plain_settings();
  settings.controller.pid.gains = {.kp = 8.0, .ki = 0.1};
  loop.channels.settings.publish({settings, 1});
  loop.run(1);
  CHECK(loop.io.written == Approx(before + 0.5 * 2.0 * 0.1));  // Ki e h of the old settings
  CHECK(loop.channels.settings_taken.load() == 1);
  LoopSettings shown;
  REQUIRE(loop.channels.in_force.fetch(shown));
  CHECK(shown.controller == settings.controller);
}

TEST_CASE("settings whose limits exclude the output wait until it is inside") {
  Loop loop;  // CO at 40
  loop.io.set_pv(50.0);
  loop.run(10);
  REQUIRE(loop.io.written == Approx(40.0));
  auto settings = plain_settings();
  settings.controller.output.high = 30.0;
  settings.controller.pid.gains.kp = 9.0;
  loop.channels.settings.publish({settings, 7});
  loop.take_events();
  loop.run(20);
  CHECK(loop.io.written == Approx(40.0));
  CHECK(loop.channels.settings_waiting.load() == 7);
  CHECK(loop.channels.settings_taken.load() == 0);
  LoopSettings shown;
  CHECK_FALSE(loop.channels.in_force.fetch(shown));
  const auto events = loop.take_events();
  CHECK(std::count_if(events.begin(), events.end(), [](const Event& e) {
          return e.code == EventCode::settings_wait && e.value == Approx(40.0);
        }) == 1);
  // Commands are judged by the settings in force.
  loop.order({.mode = Mode::manual, .output = 60.0});
  loop.run(10);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.io.written == Approx(60.0));
  // The operator moves it inside manually: taken at once, and the output doesn't move.
  loop.order({.output = 25.0});
  loop.run(40);
  CHECK(loop.io.written == Approx(25.0));
  CHECK(loop.channels.settings_waiting.load() == 0);
  CHECK(loop.channels.settings_taken.load() == 7);
  loop.order({.output = 35.0});
  loop.run(1);
  CHECK(loop.answer() == Refusal::output_out_of_limits);
}

TEST_CASE("settings that wait don't overrule a newer command") {
  LoopSettings settings = plain_settings();
  settings.controller.jacket.form = control::JacketForm::bounded;
  settings.controller.jacket.gain_per_s = 1.0;
  settings.controller.jacket.max_mean_error = 10.0;
  Loop loop(settings);
  loop.run(5);
  LoopSettings narrow = settings;
  narrow.controller.output.high = 30.0;
  loop.channels.settings.publish({narrow, 1});
  loop.run(1);
  REQUIRE(loop.channels.settings_waiting.load() == 1);
  loop.order({.jacket = JacketMode::off, .kp = 0.125, .mode = Mode::manual, .output = 20.0});
  loop.run(40);
  REQUIRE(loop.channels.settings_taken.load() == 1);
  LoopSettings shown;
  REQUIRE(loop.channels.in_force.fetch(shown));
  CHECK(shown.controller.output.high == 30.0);
  CHECK(shown.controller.pid.gains.kp == 0.125);
  CHECK(loop.row.jacket_form == control::JacketForm::off);
}

TEST_CASE("settings that wait are not applied during a fault's action") {
  LoopSettings settings = plain_settings();
  settings.safety.on_stop = OutputAction::go_to(0.0);
  Loop loop(settings);
  loop.order({.mode = Mode::manual, .output = 90.0});
  loop.run(40);
  REQUIRE(loop.io.written == Approx(90.0));
  LoopSettings narrow = settings;
  narrow.controller.output.high = 80.0;
  narrow.safety.on_stop = OutputAction::hold();
  loop.channels.settings.publish({narrow, 1});
  loop.run(2);
  REQUIRE(loop.channels.settings_waiting.load() == 1);
  loop.run(60, 0, true);
  CHECK(loop.io.written == Approx(0.0));
  CHECK(loop.channels.settings_taken.load() == 0);
}

TEST_CASE("settings that wait are dropped when they are withdrawn, or replaced by newer ones") {
  Loop loop;
  loop.run(5);
  auto narrow = plain_settings();
  narrow.controller.output.high = 30.0;
  loop.channels.settings.publish({narrow, 1});
  loop.run(2);
  REQUIRE(loop.channels.settings_waiting.load() == 1);
  const bool withdrawn = GENERATE(true, false);
  loop.channels.settings.publish({plain_settings(), 2, withdrawn});
  loop.run(1);
  CHECK(loop.channels.settings_waiting.load() == 0);
  CHECK(loop.channels.settings_taken.load() == (withdrawn ? 0 : 2));
  loop.order({.mode = Mode::manual, .output = 20.0});
  loop.run(40);
  loop.order({.output = 60.0});  // beyond the limits, which were not taken
  loop.run(20);
  CHECK(loop.io.written == Approx(60.0));
}

TEST_CASE("while the output is unknown no tighter limits are taken, but other settings are") {
  Loop loop(plain_settings(), {.mode = Mode::manual, .set_point = 50.0, .output = {}});
  loop.run(5);
  auto narrow = plain_settings();
  narrow.controller.output.high = 30.0;
  loop.channels.settings.publish({narrow, 1});
  loop.run(2);
  CHECK(loop.channels.settings_waiting.load() == 1);
  auto as_wide = plain_settings();
  as_wide.controller.pid.gains.kp = 9.0;
  loop.channels.settings.publish({as_wide, 2});
  loop.run(1);
  CHECK(loop.channels.settings_taken.load() == 2);
}

TEST_CASE("a master's gains are in force and shown before the answer") {
  Loop loop;
  loop.run(2);
  LoopSettings shown;
  REQUIRE(loop.channels.master_commands.commands.try_push({.number = 1, .kp = 3.0}));
  loop.run(1);
  REQUIRE(loop.channels.in_force.fetch(shown));
  CHECK(shown.controller.pid.gains.kp == 3.0);
  CHECK(shown.controller.pid.gains.ki == 0.5);
}

TEST_CASE("new gains take over at the present CO, with PV off its set point") {
  Loop tuned;
  Loop left;
  for (Loop* loop : {&tuned, &left}) {
    loop->run_for(1.0);
    loop->io.set_pv(46.0);
    loop->run_for(2.0);
  }
  tuned.order({.kp = 6.0, .ki = 0.1, .kd = 0.5});
  const double before = tuned.row.co;
  // The first cycle still has the old gains. Then only the new integral acts: ki e h a cycle.
  CHECK(tuned.run(1).co == Approx(left.run(1).co));
  CHECK(tuned.row.co > before);
  const double taken = tuned.row.co;
  CHECK(tuned.run(10).co - taken == Approx(10 * 0.1 * 4.0 * kPeriod));
  CHECK(left.run(10).co - taken == Approx(10 * 0.5 * 4.0 * kPeriod));
}

TEST_CASE("a command of gains is valid for those that its sender has seen") {
  Loop loop;
  loop.run(2);
  Command order{.kp = 3.0, .ki = 0.7, .kd = 0.1};
  order.expected.kp = 2.0;
  order.expected.ki = 0.5;
  order.expected.kd = 0.0;
  const auto told = [&] {
    loop.order(order);
    loop.run(1);
    return loop.answer();
  };
  SECTION("they are in force") {
    CHECK(told() == Refusal::none);
    LoopSettings shown;
    REQUIRE(loop.channels.in_force.fetch(shown));
    CHECK(shown.controller.pid.gains.kd == 0.1);
    CHECK(told() == Refusal::gains_changed);
  }
  SECTION("another has changed kp") { loop.order({.kp = 2.0001}); }
  SECTION("another has changed ki") { loop.order({.ki = 0.5001}); }
  SECTION("another has changed kd") { loop.order({.kd = 0.0001}); }
  loop.run(1);
  CHECK(told() == Refusal::gains_changed);
}

TEST_CASE("the jacket of the paper form acts only if it is allowed") {
  auto settings = plain_settings();
  settings.controller.jacket.form = control::JacketForm::paper;
  settings.controller.jacket.shadow = true;
  settings.jacket_may_act = false;
  Loop loop(settings,
            {.mode = Mode::automatic, .set_point = 50.0, .output = OutputAction::go_to(40.0)},
            daemon::rt::ValvePositionSource::read_back);
  loop.io.set_read_back(30.0);
  loop.run(5);
  loop.io.set_read_back(28.0);  // the stem does not follow
  loop.run(1);
  CHECK(loop.row.jacket_rate == 0.0F);
  CHECK(loop.row.jacket_rate_shadow != 0.0F);
  loop.order({.jacket = JacketMode::on});
  loop.run(2);
  CHECK(loop.row.jacket_rate == 0.0F);

  settings.jacket_may_act = true;
  loop.channels.settings.publish({settings, 1});
  loop.order({.jacket = JacketMode::on});
  loop.run(2);
  CHECK(loop.row.jacket_rate != 0.0F);
}

TEST_CASE("a reload sets the jacket as in its file, and reports this") {
  auto settings = plain_settings();
  settings.controller.jacket.form = control::JacketForm::paper;
  settings.controller.jacket.shadow = true;
  Loop loop(settings,
            {.mode = Mode::automatic, .set_point = 50.0, .output = OutputAction::go_to(40.0)},
            daemon::rt::ValvePositionSource::read_back);
  loop.io.set_read_back(30.0);
  loop.order({.jacket = JacketMode::on});
  loop.run(5);
  loop.io.set_read_back(28.0);
  loop.run(1);
  REQUIRE(loop.row.jacket_rate != 0.0F);
  CHECK(loop.channels.settings_taken.load() == 0);
  loop.channels.settings.publish({settings, 1});
  loop.run(1);
  loop.io.set_read_back(26.0);
  loop.run(1);
  CHECK(loop.row.jacket_rate == 0.0F);
  CHECK(loop.channels.settings_taken.load() == 1);
}

TEST_CASE("the jacket can use a model of the valve") {
  auto settings = plain_settings();
  settings.controller.jacket.form = control::JacketForm::paper;
  const bool with_play = GENERATE(true, false);
  effects::EffectChain valve;
  if (with_play) valve.add(effects::Effect(effects::Backlash(4.0)));
  Loop loop(settings,
            {.mode = Mode::automatic, .set_point = 50.0, .output = OutputAction::go_to(40.0)},
            daemon::rt::ValvePositionSource::model, valve);
  loop.run(5);
  loop.io.set_pv(45.0);
  loop.run(5);
  CHECK((loop.row.jacket_rate_shadow != 0.0F) == with_play);
}

TEST_CASE("a loop reports a change once, and is silent while its state is constant") {
  Loop loop;
  loop.run(5);
  loop.take_events();
  loop.run(50);
  CHECK(loop.take_events().empty());
  loop.order({.mode = Mode::manual});
  loop.run(50);
  auto events = loop.take_events();
  REQUIRE(events.size() == 1);
  CHECK(events[0].code == EventCode::mode_changed);
  CHECK(static_cast<Mode>(events[0].a) == Mode::manual);
  loop.channels.settings.publish({plain_settings(), 1});
  loop.run(50);
  events = loop.take_events();
  REQUIRE(events.size() == 1);
  CHECK(events[0].code == EventCode::settings_applied);
}

TEST_CASE("a fault's action is not ended by a command for a known output, or in a graver fault") {
  Loop loop;
  SECTION("commands don't reach the valve") {
    loop.run(5);
    loop.io.inputs.output_ok = false;
    loop.io.inputs.output_reason = hal::Reason::link_lost;
    loop.run(5);
    REQUIRE(loop.fault() == Fault::output_lost);
  }
  SECTION("the contact is open, and the output is unknown") {
    loop.io.set_pv(0.0, hal::Quality::bad, hal::Reason::never_received);
    loop.io.inputs.enable = hal::Enable::open;
    loop.run(5);
    REQUIRE(loop.fault() == Fault::enable_open);
  }
  loop.order({.mode = Mode::manual, .output = 60.0});
  loop.run(1);
  CHECK(loop.answer() == Refusal::output_in_fault);
}

TEST_CASE("the jacket and a compensator never act together") {
  auto settings = plain_settings();
  settings.controller.jacket.form = control::JacketForm::bounded;
  settings.controller.jacket.shadow = true;
  settings.controller.compensator.kind = control::CompensatorKind::backlash;
  settings.controller.compensator.shadow = GENERATE(true, false);
  Loop loop(settings);
  loop.order({.jacket = JacketMode::on});
  loop.run(1);
  CHECK(loop.answer() ==
        (settings.controller.compensator.shadow ? Refusal::none : Refusal::compensator_acts));
  loop.order({.jacket = JacketMode::shadow});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
}

TEST_CASE("planned moves are commanded into shadow, to act and off, and a reload ends them") {
  auto settings = plain_settings();
  settings.moves_may_act = true;
  Loop loop(settings);
  loop.channels.moves_settings.publish(
      {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0, .s = 0.6, .j = 0.3});
  const auto state = [&] { return loop.channels.moves.read(); };
  loop.run(2);
  CHECK_FALSE(state());
  loop.order({.moves = MovesMode::shadow});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  REQUIRE(state());
  CHECK(state()->shadow);
  loop.order({.moves = MovesMode::on});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  REQUIRE(state());
  CHECK_FALSE(state()->shadow);
  SECTION("off") {
    loop.order({.moves = MovesMode::off});
    loop.run(1);
    CHECK(loop.answer() == Refusal::none);
  }
  SECTION("a reload") {
    loop.channels.settings.publish({settings, 1});
    loop.run(1);
  }
  CHECK_FALSE(state());
}

TEST_CASE("planned moves don't act if the file does not allow it, nor together with the jacket") {
  auto settings = plain_settings();
  SECTION("not allowed") {
    Loop loop(settings);
    loop.channels.moves_settings.publish(
        {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0, .s = 0.6, .j = 0.3});
    loop.order({.moves = MovesMode::shadow});
    loop.run(1);
    CHECK(loop.answer() == Refusal::none);
    loop.order({.moves = MovesMode::on});
    loop.run(1);
    CHECK(loop.answer() == Refusal::moves_may_not_act);
    CHECK(loop.channels.moves.read()->shadow);
  }
  SECTION("the file has a compensator") {
    settings.controller.compensator.kind = control::CompensatorKind::backlash;
    Loop loop(settings);
    loop.order({.moves = MovesMode::shadow});
    loop.run(1);
    CHECK(loop.answer() == Refusal::compensator_of_file);
    CHECK_FALSE(loop.channels.moves.read());
  }
  SECTION("the jacket acts") {
    settings.moves_may_act = true;
    settings.controller.jacket.form = control::JacketForm::bounded;
    Loop loop(settings);
    loop.order({.moves = MovesMode::on});
    loop.run(1);
    CHECK(loop.answer() == Refusal::jacket_acts);
  }
}

TEST_CASE("planned moves whose process gain contradicts the controller's action are refused") {
  auto settings = plain_settings();
  settings.moves_may_act = true;
  const double sign = settings.controller.pid.action == control::Action::reverse ? 1.0 : -1.0;
  Loop loop(settings);
  const auto answer_to = [&](double gain, MovesMode wish) {
    loop.channels.moves_settings.publish(
        {.gain = gain, .time_constant_s = 2.0, .dead_time_s = 1.0, .s = 0.6, .j = 0.3});
    loop.order({.moves = wish});
    loop.run(1);
    return loop.answer();
  };
  const MovesMode wish = GENERATE(MovesMode::shadow, MovesMode::on);
  CHECK(answer_to(-1.5 * sign, wish) == Refusal::moves_of_other_sign);
  CHECK_FALSE(loop.channels.moves.read());
  CHECK(answer_to(1.5 * sign, wish) == Refusal::none);
  CHECK(loop.channels.moves.read());
}

TEST_CASE("in manual no state of planned moves is shown, because they are not stepped") {
  auto settings = plain_settings();
  Loop loop(settings);
  loop.channels.moves_settings.publish(
      {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0, .s = 0.6, .j = 0.3});
  loop.run(2);
  loop.order({.moves = MovesMode::shadow});
  loop.run(1);
  REQUIRE(loop.channels.moves.read());
  loop.order({.mode = Mode::manual});
  loop.run(1);
  CHECK_FALSE(loop.channels.moves.read());
  loop.order({.mode = Mode::automatic});
  loop.run(1);
  CHECK(loop.channels.moves.read());
}

// A loop that planned moves hold, with a stopped monitor and a PV that the controller would follow.
struct HeldLoop : Loop {
  HeldLoop() : Loop(with_moves()) {
    monitor_runs = false;
    io.set_pv(49.0);
    run(3);
    request(control::HoldAction::hold_here);
    run(1);
    REQUIRE((row.flags & record::kCompensatorActs) != 0);
  }
  static LoopSettings with_moves() {
    auto settings = plain_settings();
    settings.controller.compensator = {
        .kind = control::CompensatorKind::planned_moves,
        .planned = {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0, .s = 0.6, .j = 0.3}};
    return settings;
  }
  // Answers the newest sample, valid for kLeft cycles.
  void request(control::HoldAction action) {
    control::MovesSample sample;
    while (channels.moves_samples.try_pop(sample)) {
    }
    channels.moves_requests.publish({.run = sample.run,
                                     .shadow = sample.shadow,
                                     .valid_until = sample.number + kLeft,
                                     .action = action,
                                     .output = sample.held});
  }
  static constexpr int kLeft = 10;
};

TEST_CASE("planned moves hold CO until their request is too old; then the controller continues") {
  HeldLoop loop;
  const double held = loop.row.co;
  loop.run(HeldLoop::kLeft - 1);
  CHECK(loop.row.co == held);
  loop.run(1);
  CHECK((loop.row.flags & record::kCompensatorActs) == 0);
  CHECK(loop.row.co == Approx(held).margin(0.1));  // ki e h is 0.05
  loop.run(20);
  CHECK(loop.row.co > held + 0.5);
}

TEST_CASE("what ends a hold of planned moves at once, and keeps it from going on afterwards") {
  HeldLoop loop;
  const double held = loop.row.co;
  SECTION("an operator's output") {
    loop.order({.mode = Mode::manual, .output = held + 3.0});
    loop.run(1);
    CHECK(loop.row.co == Approx(held + 3.0));
    loop.order({.mode = Mode::automatic});
  }
  SECTION("a bad PV") {
    loop.io.set_pv(std::numeric_limits<double>::quiet_NaN());
    loop.run(2);
    CHECK(loop.fault() == Fault::bad_pv);
    loop.io.set_pv(49.0);
    loop.run(6);
    loop.order({.mode = Mode::automatic});
  }
  SECTION("a reload") {
    auto settings = HeldLoop::with_moves();
    settings.controller.compensator.planned.s = 0.7;
    loop.channels.settings.publish({settings, 1});
  }
  loop.run(1);
  REQUIRE(loop.mode() == Mode::automatic);
  CHECK((loop.row.flags & record::kCompensatorActs) == 0);
  const double before = loop.row.co;
  loop.run(1);
  CHECK(loop.row.co == Approx(before).margin(0.1));
  CHECK((loop.row.flags & record::kCompensatorActs) == 0);
}

TEST_CASE("an uncertain PV counts as bad unless the configuration accepts it") {
  const bool good = GENERATE(true, false);
  auto settings = plain_settings();
  settings.safety.uncertain_is_good = good;
  Loop loop(settings);
  loop.run(5);
  loop.io.set_pv(50.0, hal::Quality::uncertain, hal::Reason::sensor_failure);
  loop.run(2);
  CHECK((loop.fault() == Fault::none) == good);
}

TEST_CASE("a full ring of records costs records, never a cycle") {
  Loop loop;
  for (int i = 0; i < 5000; ++i) {
    ++loop.period;
    loop.now_ns += kPeriodNs;
    loop.cycle.run({.now_ns = loop.now_ns, .period_index = loop.period}, 0, false);
  }
  CHECK(loop.io.commands == 5000);
  CHECK(loop.channels.records.dropped() == 5000 - loop.channels.records.capacity());
}

TEST_CASE("manual and an output of one command take effect together, from automatic") {
  Loop loop;
  loop.run(5);
  loop.order({.mode = Mode::manual, .output = 42.0});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.mode() == Mode::manual);
  CHECK(loop.io.written == Approx(42.0));
}

TEST_CASE("automatic and a set point of one command take effect together, from manual") {
  Loop loop;
  loop.order({.mode = Mode::manual});
  loop.run(5);
  loop.order({.mode = Mode::automatic, .set_point = 60.0});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.row.sp == 60.0);
}

TEST_CASE("a command that can't act is refused as a whole, and reported") {
  auto settings = plain_settings();
  settings.safety.recovery = control::Recovery::manual;
  Loop loop(settings);
  loop.run(5);
  loop.take_events();
  const auto refused = [&](const Command& order, Refusal why) {
    const double output = loop.io.written;
    const std::uint32_t before = loop.channels.orders_refused.load();
    loop.order(order);
    loop.run(1);
    CHECK(loop.answer() == why);
    CHECK(loop.io.written == output);
    CHECK(loop.channels.orders_refused.load() == before + 1);
    const auto events = loop.take_events();
    CHECK(std::any_of(events.begin(), events.end(), [&](const auto& e) {
      return e.code == EventCode::command_refused && e.a == static_cast<std::uint8_t>(why);
    }));
  };
  refused({.output = 60.0}, Refusal::output_in_automatic);
  refused({.mode = Mode::automatic, .output = 60.0}, Refusal::output_in_automatic);
  refused({.set_point = 100.5}, Refusal::set_point_out_of_limits);
  refused({.kp = kNaN}, Refusal::gain_out_of_limits);
  refused({.jacket = JacketMode::on}, Refusal::no_jacket);
  refused({.set_point = 60.0, .expected = {.set_point = 49.9}}, Refusal::set_point_changed);
  refused({.set_point = 60.0, .expected = {.mode = Mode::manual}}, Refusal::mode_changed);
  refused({.set_point = 60.0, .expected = {.output = loop.row.co + 0.1}}, Refusal::output_changed);
  refused({.set_point = 60.0, .expected = {.set_point = kNaN}}, Refusal::set_point_changed);
  CHECK(loop.row.sp == 50.0);
  // A command is refused as a whole if a part of it can't be done.
  refused({.mode = Mode::manual, .output = 100.5}, Refusal::output_out_of_limits);
  CHECK(loop.mode() == Mode::automatic);
  refused({.mode = Mode::manual, .set_point = 20.0}, Refusal::set_point_tracks);
  CHECK(loop.mode() == Mode::automatic);

  loop.order({.mode = Mode::manual});
  loop.run(1);
  refused({.set_point = 20.0}, Refusal::set_point_tracks);
  // While a fault's action has the output, a command for it would be forgotten after the fault.
  loop.io.inputs.enable = hal::Enable::open;
  loop.run(30);
  REQUIRE(loop.fault() == Fault::enable_open);
  refused({.output = 60.0}, Refusal::output_in_fault);
  refused({.mode = Mode::automatic}, Refusal::manual_after_fault);
}

TEST_CASE("a value out of its limits is distinguished from a command at the wrong time") {
  using daemon::rt::is_out_of_limits;
  for (std::uint8_t code = 0; code <= static_cast<std::uint8_t>(Refusal::output_changed); ++code) {
    const auto refusal = static_cast<Refusal>(code);
    CHECK(is_out_of_limits(refusal) == (refusal == Refusal::set_point_out_of_limits ||
                                        refusal == Refusal::output_out_of_limits ||
                                        refusal == Refusal::gain_out_of_limits));
  }
}

TEST_CASE("a request for the present state is no error") {
  Loop loop;
  loop.run(5);
  loop.io.set_read_back(40.0);
  loop.run(2);
  loop.io.inputs.output_ok = false;  // the position of the output is not known any more
  loop.run(3);
  loop.order({.mode = Mode::automatic, .set_point = 55.0});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.channels.set_point_wanted.load() == 55.0);
}

TEST_CASE("in one cycle the operator has the last word, then the master, then the monitor") {
  auto settings = plain_settings();
  settings.controller.jacket.form = control::JacketForm::bounded;
  settings.controller.set_point_tracks_in_manual = false;
  Loop loop(settings);
  loop.run(5);
  // The commands act as if they had arrived in another order.
  loop.channels.operator_commands.commands.try_push({.jacket = JacketMode::off, .set_point = 61.0});
  loop.channels.master_commands.commands.try_push({.mode = Mode::manual, .set_point = 62.0});
  loop.channels.monitor_commands.commands.try_push({.jacket = JacketMode::on});
  loop.run(1);
  CHECK(loop.mode() == Mode::manual);
  CHECK(loop.channels.set_point_wanted.load() == 61.0);
  CHECK(loop.row.jacket_form == control::JacketForm::off);
  // By then the master has withdrawn the output from the operator's command, or allowed it.
  loop.channels.operator_commands.commands.try_push({.output = 45.0});
  loop.channels.master_commands.commands.try_push({.mode = Mode::automatic});
  loop.run(1);
  CHECK(loop.answer() == Refusal::output_in_automatic);
  CHECK(loop.mode() == Mode::automatic);
  loop.channels.operator_commands.commands.try_push({.output = 45.0});
  loop.channels.master_commands.commands.try_push({.mode = Mode::manual});
  loop.run(1);
  CHECK(loop.answer() == Refusal::none);
  CHECK(loop.io.written == Approx(45.0));
}

TEST_CASE("the state for the next command is published before the answer to the previous one") {
  Loop loop;
  loop.run(1);
  const auto availability = [&] { return daemon::rt::unpacked(loop.channels.availability.load()); };
  CHECK(availability() ==
        daemon::rt::LoopAvailability{.mode = Mode::automatic, .output_known = true});
  loop.order({.mode = Mode::manual});
  loop.run(1);
  CHECK(availability().mode == Mode::manual);
  loop.io.inputs.enable = hal::Enable::open;
  loop.run(1);
  CHECK(availability().output_in_fault);
}

TEST_CASE("the jacket's rate and the compensator's part are recorded separately") {
  auto settings = plain_settings();
  settings.controller.compensator = {
      .kind = control::CompensatorKind::hysteresis, .limit = 5.0, .offset = 1.5};
  Loop loop(settings);
  loop.io.set_pv(55.0);  // CO falls
  loop.run(20);
  CHECK(std::abs(loop.row.compensator) == 1.5F);
  CHECK(std::abs(loop.row.compensator_shadow) == 1.5F);
  CHECK(loop.row.jacket_rate == 0.0F);
  CHECK(loop.row.jacket_rate_shadow == 0.0F);
  CHECK((loop.row.flags & record::kCompensatorActs) != 0);
  CHECK((loop.row.flags & record::kJacketActs) == 0);
}

}  // namespace
TEST_CASE("while commands are withheld the output is not known, and no fault has an action",
          "[rt][commissioning]") {
  const bool read_back = GENERATE(false, true);
  Loop loop;
  if (read_back) loop.io.set_read_back(40.0);
  loop.run(5);
  loop.order({.number = 1, .mode = Mode::manual, .output = 40.0});
  loop.run(5);
  REQUIRE(loop.row.co == 40.0);
  loop.channels.commissioned = true;
  loop.channels.withheld_until_ns = loop.now_ns + 50 * kPeriodNs;
  // The device's watchdog drives the valve home.
  if (read_back) loop.io.set_read_back(0.0);
  loop.run(49);
  CHECK_FALSE(loop.io.last.write);
  CHECK(loop.io.written == 40.0);
  CHECK(std::isnan(loop.row.co));
  CHECK(loop.fault() == Fault::output_unknown);
  CHECK((loop.row.flags & record::kOutOfService) != 0);
  CHECK_FALSE(daemon::rt::unpacked(loop.channels.availability).output_known);
  CHECK(std::isnan(loop.channels.output_wanted));
  // Without a read-back it continues from its last request, otherwise from the valve's position.
  loop.run(2);
  CHECK(loop.io.last.write);
  CHECK(loop.fault() == Fault::none);
  CHECK(loop.mode() == Mode::manual);
  CHECK(loop.io.written == (read_back ? 0.0 : 40.0));
  loop.channels.commissioned = false;
  loop.run(1);
  CHECK((loop.row.flags & record::kOutOfService) == 0);
}

TEST_CASE("a command for an output ends the withholding of commands, but automatic does not",
          "[rt][commissioning]") {
  Loop loop;
  loop.run(5);
  loop.order({.number = 1, .mode = Mode::manual});
  loop.run(2);
  loop.channels.withheld_until_ns = INT64_MAX;
  loop.run(5);
  REQUIRE_FALSE(loop.io.last.write);
  SECTION("an output, which is sent at once") {
    loop.order({.number = 2, .output = 30.0});
    loop.run(1);
    CHECK(loop.io.last.write);
    CHECK(loop.io.written == 30.0);
  }
  SECTION("automatic is refused while the position of the output is unknown") {
    loop.order({.number = 2, .mode = Mode::automatic});
    loop.run(1);
    CHECK(loop.answer() == Refusal::output_unknown);
    CHECK_FALSE(loop.io.last.write);
  }
  SECTION("a loop in automatic is not silenced") {
    loop.channels.withheld_until_ns = 0;
    loop.run(1);
    loop.order({.number = 2, .mode = Mode::automatic});
    loop.run(1);
    loop.channels.withheld_until_ns = INT64_MAX;
    loop.run(1);
    CHECK(loop.io.last.write);
  }
}

TEST_CASE("offered settings wait while a loop is being commissioned", "[rt][commissioning]") {
  Loop loop;
  loop.run(5);
  LoopSettings offered = plain_settings();
  offered.controller.pid.gains.kp = 7.0;
  loop.channels.commissioned = true;
  const bool offered_before = GENERATE(true, false);
  if (offered_before) {
    // The settings already waited for the output when the commissioning began.
    loop.channels.commissioned = false;
    offered.controller.output.high = 20.0;
    loop.channels.settings.publish({.settings = offered, .number = 3});
    loop.run(2);
    loop.channels.commissioned = true;
    loop.order({.number = 1, .mode = Mode::manual, .output = 10.0});
  } else {
    loop.channels.settings.publish({.settings = offered, .number = 3});
  }
  loop.run(50);
  LoopSettings in_force = plain_settings();
  loop.channels.in_force.fetch(in_force);
  CHECK(in_force.controller.pid.gains.kp == 2.0);
  CHECK(loop.channels.settings_seen == 3);
  CHECK(loop.channels.settings_waiting == 3);
  CHECK(loop.channels.settings_taken == 0);
  loop.channels.commissioned = false;
  loop.run(1);
  loop.channels.in_force.fetch(in_force);
  CHECK(in_force.controller.pid.gains.kp == 7.0);
  CHECK(loop.channels.settings_waiting == 0);
  CHECK(loop.channels.settings_taken == 3);
}

}  // namespace loopwarden::tests::control_cycle_test
