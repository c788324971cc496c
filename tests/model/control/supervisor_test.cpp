// SPDX-License-Identifier: Apache-2.0
#include "model/control/supervisor.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace supervisor_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod = 0.1;  // s
constexpr Conditions kGood{.pv_good = true};

SafetySettings settings() {
  return {.on_stop = OutputAction::go_to(1.0),
          .on_enable_open = OutputAction::go_to(2.0),
          .on_not_finite = OutputAction::go_to(3.0),
          .on_late_cycle = OutputAction::go_to(4.0),
          .on_output_lost = OutputAction::go_to(5.0),
          .on_bad_pv = OutputAction::go_to(6.0),
          .recovery = Recovery::previous_mode,
          .recovery_delay_s = 0.5};
}

Supervisor running(const SafetySettings& s) {
  Supervisor supervisor(s, kPeriod);
  REQUIRE(supervisor.step(kGood).fault == Fault::none);
  return supervisor;
}

// Returns the number of periods with good conditions until the fault ends.
int periods_to_recover(Supervisor& supervisor) {
  int periods = 1;
  while (supervisor.step(kGood).fault != Fault::none) {
    REQUIRE(++periods < 1000);
  }
  return periods;
}

}  // namespace

TEST_CASE("every fault has its own action", "[control][supervisor]") {
  struct Case {
    Conditions conditions;
    Fault fault;
    double value;
  };
  const auto c = GENERATE(Case{{.stop = true, .pv_good = true}, Fault::stop, 1.0},
                          Case{{.enable_open = true, .pv_good = true}, Fault::enable_open, 2.0},
                          Case{{.not_finite = true, .pv_good = true}, Fault::not_finite, 3.0},
                          Case{{.late_cycle = true, .pv_good = true}, Fault::late_cycle, 4.0},
                          Case{{.output_lost = true, .pv_good = true}, Fault::output_lost, 5.0},
                          Case{{.pv_good = false}, Fault::bad_pv, 6.0});
  CAPTURE(to_text(c.fault));
  Supervisor supervisor = running(settings());
  const Decision decision = supervisor.step(c.conditions);
  CHECK(decision.fault == c.fault);
  CHECK(decision.action == OutputAction::go_to(c.value));
  CHECK_FALSE(decision.to_manual);
  CHECK(supervisor.fault() == c.fault);
}

TEST_CASE("the gravest fault decides", "[control][supervisor]") {
  Supervisor supervisor = running(settings());
  Conditions all{.stop = true,
                 .enable_open = true,
                 .not_finite = true,
                 .late_cycle = true,
                 .output_lost = true,
                 .pv_good = false};
  CHECK(supervisor.step(all).fault == Fault::stop);
  all.stop = false;
  CHECK(supervisor.step(all).fault == Fault::enable_open);
  all.enable_open = false;
  CHECK(supervisor.step(all).fault == Fault::not_finite);
  all.not_finite = false;
  CHECK(supervisor.step(all).fault == Fault::late_cycle);
  all.late_cycle = false;
  CHECK(supervisor.step(all).fault == Fault::output_lost);
  all.output_lost = false;
  CHECK(supervisor.step(all).fault == Fault::bad_pv);
}

TEST_CASE("bad PV holds first, then acts", "[control][supervisor]") {
  SafetySettings s = settings();
  s.bad_pv_hold_s = 1.0;
  Supervisor supervisor = running(s);
  constexpr Conditions kBad{.pv_good = false};
  for (int k = 0; k < 10; ++k) REQUIRE(supervisor.step(kBad).action == OutputAction::hold());
  CHECK(supervisor.step(kBad).action == OutputAction::go_to(6.0));

  SECTION("a late cycle in between does not start the wait again") {
    supervisor.step({.late_cycle = true, .pv_good = false});
    CHECK(supervisor.step(kBad).action == OutputAction::go_to(6.0));
  }
  SECTION("neither does one good sample") {
    supervisor.step(kGood);
    CHECK(supervisor.step(kBad).action == OutputAction::go_to(6.0));
  }
  SECTION("but a PV that was good for the recovery delay does") {
    periods_to_recover(supervisor);
    CHECK(supervisor.step(kBad).action == OutputAction::hold());
  }
}

TEST_CASE("a PV that is bad every other period does not hold the output for ever",
          "[control][supervisor]") {
  SafetySettings s = settings();
  s.bad_pv_hold_s = 1.0;
  Supervisor supervisor = running(s);
  for (int k = 0; k < 10; ++k) {
    REQUIRE(supervisor.step({.pv_good = k % 2 == 1}).action == OutputAction::hold());
  }
  CHECK(supervisor.step({.pv_good = false}).action == OutputAction::go_to(6.0));
}

TEST_CASE("the wait for a bad PV has its full length also soon after the start",
          "[control][supervisor]") {
  SafetySettings s = settings();
  s.bad_pv_hold_s = 0.3;
  Supervisor supervisor(s, kPeriod);
  for (int k = 0; k < 20; ++k) supervisor.step({.pv_good = false});
  for (int k = 0; k < 2; ++k) supervisor.step(kGood);
  for (int k = 0; k < 3; ++k) {
    REQUIRE(supervisor.step({.pv_good = false}).action == OutputAction::hold());
  }
  CHECK(supervisor.step({.pv_good = false}).action == OutputAction::go_to(6.0));
}

TEST_CASE("a fault ends after its cause has been gone for the delay", "[control][supervisor]") {
  Supervisor supervisor = running(settings());
  supervisor.step({.output_lost = true, .pv_good = true});
  for (int k = 0; k < 4; ++k) {
    const Decision decision = supervisor.step(kGood);
    REQUIRE(decision.fault == Fault::output_lost);
    REQUIRE(decision.action == OutputAction::go_to(5.0));
  }
  SECTION("and not before") { CHECK(supervisor.step(kGood).fault == Fault::none); }
  SECTION("a relapse starts the delay again") {
    supervisor.step({.output_lost = true, .pv_good = true});
    CHECK(periods_to_recover(supervisor) == 5);
  }
}

TEST_CASE("a delay of zero ends the fault with its cause", "[control][supervisor]") {
  SafetySettings s = settings();
  s.recovery_delay_s = 0.0;
  Supervisor supervisor = running(s);
  supervisor.step({.not_finite = true, .pv_good = true});
  CHECK(supervisor.step(kGood).fault == Fault::none);
}

TEST_CASE("recovery follows the settings, once", "[control][supervisor]") {
  SafetySettings s = settings();
  s.recovery_delay_s = 0.1;
  const auto recovery = GENERATE(Recovery::manual, Recovery::previous_mode);
  s.recovery = recovery;
  Supervisor supervisor = running(s);
  supervisor.step({.pv_good = false});
  const Decision ended = supervisor.step(kGood);
  CHECK(ended.fault == Fault::none);
  CHECK(ended.to_manual == (recovery == Recovery::manual));
  CHECK_FALSE(supervisor.step(kGood).to_manual);
}

TEST_CASE("a lesser fault takes over at once when a graver one ends", "[control][supervisor]") {
  Supervisor supervisor = running(settings());
  supervisor.step({.enable_open = true, .pv_good = false});
  CHECK(supervisor.step({.pv_good = false}).fault == Fault::bad_pv);
}

TEST_CASE("the supervisor stays in its start state until a good PV was read",
          "[control][supervisor]") {
  SafetySettings s = settings();
  s.recovery = Recovery::manual;
  Supervisor supervisor(s, kPeriod);
  CHECK(supervisor.fault() == Fault::starting);
  for (int k = 0; k < 20; ++k) {
    const Decision decision = supervisor.step({.output_lost = k % 2 == 0, .pv_good = k % 2 == 0});
    REQUIRE(decision.fault == Fault::starting);
    REQUIRE(decision.action == OutputAction::hold());
  }

  SECTION("then the loop starts at once, in its configured mode") {
    const Decision decision = supervisor.step(kGood);
    CHECK(decision.fault == Fault::none);
    CHECK_FALSE(decision.to_manual);
  }
  SECTION("a graver fault in between still leaves it a start") {
    CHECK(supervisor.step({.enable_open = true, .pv_good = false}).fault == Fault::enable_open);
    CHECK(supervisor.step({.late_cycle = true, .pv_good = false}).fault == Fault::starting);
    CHECK(supervisor.step({.pv_good = false}).fault == Fault::starting);
    CHECK(supervisor.step({.output_lost = true, .pv_good = true}).fault == Fault::starting);
    CHECK(supervisor.step(kGood).fault == Fault::none);
  }
  SECTION("a stop is obeyed all the same") {
    CHECK(supervisor.step({.stop = true}).action == OutputAction::go_to(1.0));
  }
}

namespace {

// As in the cycle: the read-back of the period is processed after its faults.
Decision period(Supervisor& supervisor, const Conditions& conditions, bool output_known) {
  return supervisor.settle(supervisor.step(conditions), output_known);
}

}  // namespace

TEST_CASE("a loop whose output is unknown does not run", "[control][supervisor]") {
  SafetySettings s = settings();
  const auto recovery = GENERATE(Recovery::manual, Recovery::previous_mode);
  s.recovery = recovery;
  Supervisor supervisor(s, kPeriod);
  CHECK(period(supervisor, {.pv_good = false}, false).fault == Fault::starting);
  for (int k = 0; k < 20; ++k) {
    const Decision decision = period(supervisor, kGood, false);
    REQUIRE(decision.fault == Fault::output_unknown);
    REQUIRE(decision.action == OutputAction::hold());
    REQUIRE(supervisor.fault() == Fault::output_unknown);
  }

  SECTION("it resumes at once, in its previous mode, when the output is known") {
    const Decision decision = period(supervisor, kGood, true);
    CHECK(decision.fault == Fault::none);
    CHECK_FALSE(decision.to_manual);
    CHECK(supervisor.fault() == Fault::none);
  }
  SECTION("every other fault is graver, but its action has no output to start from") {
    const Decision bad = period(supervisor, {.pv_good = false}, false);
    CHECK(bad.fault == Fault::bad_pv);
    CHECK(bad.action == OutputAction::hold());
    const Decision lost = period(supervisor, {.output_lost = true, .pv_good = true}, false);
    CHECK(lost.fault == Fault::output_lost);
    CHECK(lost.action == OutputAction::hold());
  }
  SECTION("the stop action is obeyed all the same") {
    const Decision stop = period(supervisor, {.stop = true, .pv_good = true}, false);
    CHECK(stop.fault == Fault::stop);
    CHECK(stop.action == OutputAction::go_to(1.0));
  }
  SECTION("a fault whose end leaves the loop in manual leaves it there") {
    period(supervisor, {.late_cycle = true, .pv_good = true}, false);
    bool to_manual = false;
    for (int k = 0; k < 5; ++k) to_manual |= period(supervisor, kGood, false).to_manual;
    CHECK(supervisor.fault() == Fault::output_unknown);
    CHECK(to_manual == (recovery == Recovery::manual));
  }
}

TEST_CASE("a value that is learnt in the period shows no fault", "[control][supervisor]") {
  Supervisor supervisor(settings(), kPeriod);
  CHECK(period(supervisor, kGood, true).fault == Fault::none);
}

TEST_CASE("new settings count from the next period", "[control][supervisor]") {
  Supervisor supervisor = running(settings());
  supervisor.step({.pv_good = false});
  SafetySettings s = settings();
  s.on_bad_pv = OutputAction::hold();
  supervisor.configure(s);
  CHECK(supervisor.step({.pv_good = false}).action == OutputAction::hold());
}

TEST_CASE("every fault has a separate text", "[control][supervisor]") {
  CHECK(to_text(Fault::none) == std::string("none"));
  CHECK(to_text(Fault::starting) == std::string("starting"));
  CHECK(to_text(Fault::bad_pv) == std::string("bad PV"));
  CHECK(to_text(Fault::output_lost) == std::string("output lost"));
  CHECK(to_text(Fault::late_cycle) == std::string("late cycle"));
  CHECK(to_text(Fault::not_finite) == std::string("not finite"));
  CHECK(to_text(Fault::enable_open) == std::string("enable open"));
  CHECK(to_text(Fault::stop) == std::string("stop"));
  CHECK(to_text(Fault::output_unknown) == std::string("output unknown"));
}

}  // namespace supervisor_test
