// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/loop_alarms.hpp"

#include "model/alarm/alarm_guide.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "model/alarm/ne107.hpp"

namespace loop_alarms_test {

using namespace loopwarden;
using namespace loopwarden::alarm;

namespace {

using S = AlarmState;
using K = AlarmKind;

AlarmConditions with(std::initializer_list<std::pair<K, double>> on) {
  AlarmConditions conditions{};
  for (const auto& [kind, severity] : on) conditions[index_of(kind)] = {true, severity};
  return conditions;
}

std::array<ProcessChange, 1> one(K kind, bool on, std::uint64_t began = 0) {
  return {ProcessChange{kind, on, began}};
}

LoopAlarms healthy() {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.window_judged(0, {});
  return alarms;
}

}  // namespace

TEST_CASE("low air explains the others: one root alarm", "[monitor][alarm]") {
  LoopAlarms alarms = healthy();
  alarms.window_judged(1, with({{K::stiction, 5.0}}));
  REQUIRE(alarms.act(K::stiction, AlarmAction::acknowledge, 2).accepted);

  const AlarmTransitions root =
      alarms.window_judged(3, with({{K::stiction, 6.0}, {K::low_air_supply, 20.0}}));
  REQUIRE(root.view().size() == 6);  // the root alarm, the raised alarm, and four that are off
  CHECK(alarms.alarm(K::low_air_supply).state() == S::unacknowledged);
  for (const K kind : {K::stiction, K::backlash, K::hysteresis, K::unknown}) {
    CHECK(alarms.alarm(kind).state() == S::suppressed);
    CHECK(alarms.alarm(kind).is_consequence());
  }
  CHECK(alarms.any_suppressed());

  SECTION("a condition found meanwhile is its consequence, not an alarm") {
    const auto more =
        alarms.window_judged(4, with({{K::backlash, 9.0}, {K::low_air_supply, 20.0}}));
    CHECK(more.empty());
    CHECK_FALSE(alarms.alarm(K::backlash).unacknowledged());
  }
  SECTION("shelving the root silences it, and explains as before") {
    REQUIRE(alarms.act(K::low_air_supply, AlarmAction::shelve, 4, 1000).accepted);
    CHECK(alarms.alarm(K::stiction).state() == S::suppressed);
  }
  SECTION("when the air is back, the others follow their own condition") {
    alarms.window_judged(5, with({{K::stiction, 6.0}}));
    CHECK(alarms.alarm(K::low_air_supply).state() == S::returned_unacknowledged);
    CHECK(alarms.alarm(K::stiction).state() == S::acknowledged);
    CHECK(alarms.alarm(K::backlash).state() == S::normal);
  }
}

TEST_CASE(
    "a window that can't be judged suppresses alarms that are off and keeps those that are on",
    "[monitor][alarm]") {
  LoopAlarms alarms = healthy();
  alarms.window_judged(1, with({{K::hysteresis, 5.0}}));
  const AlarmTransitions changed = alarms.window_not_valid();
  CHECK(changed.view().size() == 5);
  CHECK(alarms.alarm(K::hysteresis).state() == S::unacknowledged);
  CHECK(alarms.alarm(K::stiction).state() == S::suppressed);
  CHECK(alarms.window_not_valid().empty());  // reported once
  const AlarmTransitions back = alarms.window_judged(2, with({{K::hysteresis, 5.0}}));
  CHECK(back.view().size() == 5);
  for (const AlarmTransition& t : back.view()) {
    CHECK(t.from == S::suppressed);
    CHECK(t.to == S::normal);
  }
}

TEST_CASE("transitions name the alarm, both states and the severity", "[monitor][alarm]") {
  LoopAlarms alarms = healthy();
  const AlarmTransitions raised = alarms.window_judged(1, with({{K::backlash, 7.5}}));
  REQUIRE(raised.view().size() == 1);
  CHECK(raised.view()[0].kind == K::backlash);
  CHECK(raised.view()[0].from == S::normal);
  CHECK(raised.view()[0].to == S::unacknowledged);
  CHECK(raised.view()[0].severity_percent == 7.5);

  const auto refused = alarms.act(K::stiction, AlarmAction::acknowledge, 2);
  CHECK_FALSE(refused.accepted);
  CHECK(refused.transitions.empty());
  REQUIRE(alarms.act(K::backlash, AlarmAction::shelve, 3, 100).accepted);
  CHECK(alarms.any_shelved());
  for (const AlarmKind kind : kAlarmKinds) CHECK_FALSE(alarms.alarm(kind).unacknowledged());
  CHECK(alarms.pass_time(99).empty());
  const AlarmTransitions back = alarms.pass_time(100);
  REQUIRE(back.view().size() == 1);
  CHECK(back.view()[0].from == S::shelved);
  CHECK(back.view()[0].to == S::unacknowledged);
}

TEST_CASE("after a restart the root alarm explains the others again before the first window",
          "[monitor][alarm]") {
  LoopAlarms before = healthy();
  before.window_judged(1, with({{K::low_air_supply, 20.0}, {K::stiction, 3.0}}));
  LoopAlarms after{AlarmSettings{}};
  for (const K kind : kAlarmKinds) after.restore(kind, before.alarm(kind).memory());
  CHECK(after.alarm(K::low_air_supply).state() == S::unacknowledged);
  CHECK(after.alarm(K::stiction).state() == S::suppressed);
}

TEST_CASE(
    "a process alarm is acknowledged, shelved and remembered like others, but ignores windows and "
    "low air",
    "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  CHECK(alarms.alarm(K::bad_pv).state() == S::normal);  // it can be raised without a window
  const AlarmTransitions came = alarms.process_changed(5, one(K::bad_pv, true));
  REQUIRE(came.view().size() == 2);
  CHECK(came.view()[0].kind == K::bad_pv);
  CHECK(came.view()[0].to == S::unacknowledged);
  CHECK(came.view()[0].reason == AlarmReason::process);
  CHECK(came.view()[1].kind == K::not_normal_mode);  // a possible consequence
  CHECK(came.view()[1].to == S::suppressed);
  CHECK(alarms.alarm(K::bad_pv).memory().raised_ms == 5);

  alarms.window_judged(6, with({{K::low_air_supply, 20.0}}));
  alarms.window_judged(7, {});
  alarms.window_not_valid();
  CHECK(alarms.alarm(K::bad_pv).state() == S::unacknowledged);
  CHECK(alarms.alarm(K::output_lost).state() == S::normal);
  REQUIRE(alarms.act(K::bad_pv, AlarmAction::acknowledge, 8).accepted);

  LoopAlarms after{AlarmSettings{}};
  for (const K kind : kAlarmKinds) after.restore(kind, alarms.alarm(kind).memory());
  CHECK(after.alarm(K::bad_pv).state() == S::acknowledged);
  CHECK(after.alarm(K::output_unknown).state() == S::normal);
  REQUIRE(after.act(K::bad_pv, AlarmAction::shelve, 9, 1000).accepted);
  after.process_changed(10, one(K::bad_pv, false));
  CHECK(after.alarm(K::bad_pv).state() == S::shelved);
  after.pass_time(1000);
  CHECK(after.alarm(K::bad_pv).state() == S::normal);
}

TEST_CASE("a consequence is suppressed while its cause is on, and is raised after it",
          "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.fit(K::deviation);
  alarms.process_changed(1, one(K::deviation, true));
  const AlarmTransitions lost = alarms.process_changed(2, one(K::output_lost, true));
  CHECK(lost.view().size() == 4);  // itself, the deviation, and two possible consequences
  CHECK(alarms.alarm(K::deviation).state() == S::suppressed);
  CHECK(alarms.cause_of(K::deviation) == K::output_lost);
  CHECK_FALSE(alarms.cause_of(K::bad_pv));
  alarms.process_changed(3, one(K::not_normal_mode, true));
  CHECK(alarms.alarm(K::not_normal_mode).state() == S::suppressed);
  // A shelf hides the cause, but not its consequences.
  REQUIRE(alarms.act(K::output_lost, AlarmAction::shelve, 4, 1000).accepted);
  CHECK(alarms.alarm(K::not_normal_mode).state() == S::suppressed);
  alarms.process_changed(5, one(K::output_lost, false));
  CHECK(alarms.alarm(K::not_normal_mode).state() == S::unacknowledged);
  CHECK(alarms.alarm(K::deviation).state() == S::unacknowledged);
}

TEST_CASE("a limit is raised as its own alarm as soon as PV is good, though bad_pv stays on",
          "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.fit(K::pv_high_high);
  alarms.pv_lost(true);
  alarms.process_changed(1, one(K::bad_pv, true));
  alarms.process_changed(2, one(K::not_normal_mode, true));
  alarms.process_changed(3, one(K::pv_high_high, true));
  CHECK(alarms.alarm(K::pv_high_high).state() == S::suppressed);
  const AlarmTransitions known = alarms.pv_lost(false);
  REQUIRE(known.view().size() == 1);
  CHECK(alarms.alarm(K::pv_high_high).state() == S::unacknowledged);
  CHECK(alarms.alarm(K::bad_pv).active());
  CHECK(alarms.alarm(K::not_normal_mode).state() == S::suppressed);
}

TEST_CASE("a consequence that began and ended with its cause is reported by the cause only",
          "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.process_changed(
      1, std::vector<ProcessChange>{{K::output_lost, true}, {K::not_normal_mode, true}});
  alarms.process_changed(
      2, std::vector<ProcessChange>{{K::output_lost, false}, {K::not_normal_mode, false}});
  CHECK(alarms.alarm(K::output_lost).state() == S::returned_unacknowledged);
  CHECK(alarms.alarm(K::not_normal_mode).state() == S::normal);
}

TEST_CASE("the graph of consequences ends, and no alarm follows from itself", "[monitor][alarm]") {
  for (const K effect : kAlarmKinds) {
    CHECK_FALSE(follows(effect, effect));
    for (const K cause : kAlarmKinds) {
      CAPTURE(to_text(effect), to_text(cause));
      if (!follows(effect, cause)) continue;
      CHECK_FALSE(follows(cause, effect));
      CHECK(is_process_alarm(effect) == is_process_alarm(cause));
      // So the active alarms always include one without an active cause.
      for (const K root : kAlarmKinds) {
        if (follows(cause, root)) CHECK_FALSE(follows(root, effect));
      }
    }
  }
}

TEST_CASE("the first raised of several process alarms is marked", "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.process_changed(5, one(K::output_lost, true));
  CHECK_FALSE(alarms.first_out(K::output_lost));  // it is the only one
  alarms.process_changed(6, one(K::bad_pv, true));
  CHECK(alarms.first_out(K::output_lost));
  CHECK_FALSE(alarms.first_out(K::bad_pv));
  // Cleared but not acknowledged, it still is the first.
  alarms.process_changed(7, one(K::output_lost, false));
  CHECK(alarms.first_out(K::output_lost));
  alarms.act(K::output_lost, AlarmAction::acknowledge, 8);
  CHECK_FALSE(alarms.first_out(K::output_lost));
}

TEST_CASE(
    "the first alarm is the one that began first, whatever its delay; a restored alarm is older",
    "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.fit(K::enable_open);
  alarms.fit(K::pv_low_low);
  alarms.process_changed(5, one(K::pv_low_low, true, 130));
  alarms.process_changed(9, one(K::enable_open, true, 100));
  CHECK(alarms.first_out(K::enable_open));
  CHECK_FALSE(alarms.first_out(K::pv_low_low));
  alarms.process_changed(10, one(K::bad_pv, true, 100));  // of one period: the first of the list
  CHECK(alarms.first_out(K::bad_pv));
  alarms.process_changed(11, one(K::not_normal_mode, true, 1));  // follows from them
  CHECK(alarms.first_out(K::bad_pv));
  CHECK_FALSE(alarms.first_out(K::not_normal_mode));
  AlarmMemory old;
  old.raised = S::acknowledged;
  old.raised_ms = 4;
  alarms.restore(K::output_lost, old);
  CHECK(alarms.first_out(K::output_lost));
  CHECK_FALSE(alarms.first_out(K::bad_pv));
}

TEST_CASE("a deviation that is switched off shows suppressed while it is clear",
          "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{}};
  alarms.fit(K::deviation);
  alarms.process_changed(1, one(K::deviation, true));
  alarms.deviation_rests(true);
  CHECK(alarms.alarm(K::deviation).state() == S::unacknowledged);
  REQUIRE(alarms.act(K::deviation, AlarmAction::acknowledge, 2).accepted);
  alarms.process_changed(3, one(K::deviation, false));
  CHECK(alarms.alarm(K::deviation).state() == S::suppressed);
  alarms.deviation_rests(false);
  CHECK(alarms.alarm(K::deviation).state() == S::normal);
}

TEST_CASE("an alarm that is not fitted is not restored", "[monitor][alarm]") {
  LoopAlarms before{AlarmSettings{}};
  before.fit(K::pv_high);
  before.process_changed(1, one(K::pv_high, true));
  LoopAlarms after{AlarmSettings{}};
  after.restore(K::pv_high, before.alarm(K::pv_high).memory());
  CHECK_FALSE(after.fitted(K::pv_high));
  CHECK(after.alarm(K::pv_high).state() == S::normal);
}

TEST_CASE("a latching process alarm stays until it is reset", "[monitor][alarm]") {
  LoopAlarms alarms{AlarmSettings{.latching = true}};
  alarms.process_changed(1, one(K::not_normal_mode, true));
  alarms.process_changed(2, one(K::not_normal_mode, false));
  CHECK(alarms.alarm(K::not_normal_mode).state() == S::latched_unacknowledged);
}

TEST_CASE("behind a lost connection process alarms are suppressed, valve alarms are not",
          "[monitor][alarm]") {
  LoopAlarms alarms = healthy();
  alarms.fit(K::source_lost);
  alarms.fit(K::pv_high);
  alarms.window_judged(1, with({{K::stiction, 5.0}}));
  alarms.pv_lost(true);
  alarms.behind_outage(true);
  alarms.process_changed(2, one(K::source_lost, true));
  alarms.process_changed(2, one(K::pv_high, true));
  for (const K kind : {K::source_lost, K::pv_high}) {
    CHECK(alarms.alarm(kind).state() == S::suppressed);
    CHECK(alarms.alarm(kind).active());
    CHECK(alarms.follows_outage(kind));
  }
  CHECK(alarms.alarm(K::stiction).state() == S::unacknowledged);
  SECTION("an alarm that clears behind it needs no acknowledgement") {
    alarms.process_changed(3, one(K::source_lost, false));
    alarms.process_changed(3, one(K::pv_high, false));
    alarms.behind_outage(false);
    CHECK(alarms.alarm(K::source_lost).state() == S::normal);
  }
  SECTION("without the outage it is the loop's own") {
    alarms.behind_outage(false);
    CHECK(alarms.alarm(K::source_lost).state() == S::unacknowledged);
  }
}

TEST_CASE("bad_pv of a watched loop never says that PV is not controlled", "[monitor][alarm]") {
  const AlarmGuide guide = guide_of(K::bad_pv, true);
  const std::string text = std::string(guide.cause) + guide.consequence + guide.time_to_act;
  CHECK(text.find("controlled") == std::string::npos);
  CHECK(text.find("safe_actions") == std::string::npos);
  CHECK(std::string(guide_of(K::output_lost, true).cause) == guide_of(K::output_lost).cause);
}

TEST_CASE("process alarms have separate names, no size, and a guide", "[monitor][alarm]") {
  std::vector<std::string> names;
  for (const K kind : kProcessAlarms) {
    names.emplace_back(to_text(kind));
    CHECK(is_process_alarm(kind));
    CHECK_FALSE(has_size(kind));
    const AlarmGuide guide = guide_of(kind);
    for (const K other : kAlarmKinds) {
      if (other != kind) CHECK(std::string(guide_of(other).action) != guide.action);
    }
  }
  CHECK(names == std::vector<std::string>{"bad_pv", "output_lost", "output_unknown",
                                          "not_normal_mode", "enable_open", "source_lost",
                                          "deviation", "pv_high_high", "pv_high", "pv_low",
                                          "pv_low_low", "rate_of_change"});
  CHECK(process_bit(K::bad_pv) == 1);
  CHECK(process_bit(K::rate_of_change) == 1U << 11U);
  for (const K kind : kValveAlarms) CHECK_FALSE(is_process_alarm(kind));
  CHECK(usual_priority(K::output_lost) == Priority::critical);
  CHECK(usual_priority(K::not_normal_mode) == Priority::medium);
  CHECK(usual_priority(K::model_gap) == Priority::low);
}

TEST_CASE("NE 107: the gravest of the present conditions", "[monitor][ne107]") {
  constexpr double kSevere = 10.0;  // %
  LoopAlarms alarms = healthy();
  CHECK(condensed({}, alarms, kSevere) == Ne107::normal);
  CHECK(condensed({.pv_uncertain = true}, alarms, kSevere) == Ne107::out_of_specification);
  CHECK(condensed({.manual = true}, alarms, kSevere) == Ne107::function_check);
  CHECK(condensed({.simulated = true, .pv_uncertain = true}, alarms, kSevere) ==
        Ne107::function_check);
  CHECK(condensed({.failed = true, .simulated = true, .manual = true, .pv_uncertain = true}, alarms,
                  kSevere) == Ne107::failure);

  // A loop that is neither in its normal mode nor in manual is no sign of a faulty device.
  alarms.process_changed(1, one(K::not_normal_mode, true));
  CHECK(condensed({}, alarms, kSevere) == Ne107::normal);

  alarms.window_judged(1, with({{K::stiction, 9.9}}));
  CHECK(condensed({}, alarms, kSevere) == Ne107::maintenance_required);
  alarms.act(K::stiction, AlarmAction::shelve, 2, 100);
  CHECK(condensed({}, alarms, kSevere) == Ne107::maintenance_required);
  alarms.window_judged(3, with({{K::stiction, 10.0}}));
  CHECK(condensed({}, alarms, kSevere) == Ne107::out_of_specification);
  alarms.window_judged(4, {});
  CHECK(condensed({}, alarms, kSevere) == Ne107::normal);
  alarms.window_judged(5, with({{K::low_air_supply, 0.1}}));
  CHECK(condensed({}, alarms, kSevere) == Ne107::out_of_specification);

  CHECK(gravest(Ne107::function_check, Ne107::out_of_specification) == Ne107::function_check);
}

TEST_CASE("a condition that is explained counts for the other alarm until it clears",
          "[monitor][alarm]") {
  LoopAlarms alarms = healthy();
  alarms.window_judged(1, with({{K::stiction, 5.0}}));
  REQUIRE(alarms.act(K::stiction, AlarmAction::acknowledge, 2).accepted);
  const AlarmTransitions explained = alarms.explained(3, K::stiction, K::backlash, 4.0);
  REQUIRE(explained.view().size() == 2);
  for (const AlarmTransition& t : explained.view()) CHECK(t.reason == AlarmReason::explained);
  CHECK(alarms.alarm(K::stiction).state() == S::normal);
  CHECK(alarms.alarm(K::backlash).state() == S::unacknowledged);
  CHECK(alarms.alarm(K::backlash).memory().severity_percent == 4.0);

  // The windows still name stiction, which now counts as backlash.
  CHECK(alarms.window_judged(4, with({{K::stiction, 6.0}})).empty());
  CHECK(alarms.alarm(K::backlash).memory().severity_percent == 4.0);
  alarms.window_judged(5, {});
  CHECK(alarms.alarm(K::backlash).state() == S::returned_unacknowledged);
  // The condition has ended, so the next stiction counts as stiction.
  alarms.window_judged(6, with({{K::stiction, 6.0}}));
  CHECK(alarms.alarm(K::stiction).state() == S::unacknowledged);
}

TEST_CASE("a condition that is explained again counts for the newest name, or for its own",
          "[alarm]") {
  LoopAlarms alarms = healthy();
  const auto on = [&](std::initializer_list<K> kinds) {
    AlarmConditions conditions{};
    for (const K kind : kinds) conditions[index_of(kind)].on = true;
    return conditions;
  };
  alarms.judged(1, on({K::model_gap}), AlarmReason::twin);
  alarms.explained(2, K::model_gap, K::stiction, 4.0);
  CHECK(alarms.alarm(K::stiction).active());
  alarms.explained(3, K::model_gap, K::backlash, 5.0);
  CHECK_FALSE(alarms.alarm(K::stiction).active());
  CHECK(alarms.alarm(K::backlash).active());
  alarms.explained(4, K::model_gap, K::model_gap, 0.0);
  CHECK_FALSE(alarms.alarm(K::backlash).active());
  CHECK(alarms.alarm(K::model_gap).active());
  alarms.judged(5, on({K::model_gap}), AlarmReason::twin);
  CHECK(alarms.alarm(K::model_gap).active());
  // Windows also show the stick: it stays on when the twin's gap is no stick.
  alarms.explained(6, K::model_gap, K::stiction, 4.0);
  alarms.judged(7, on({K::model_gap, K::stiction}), AlarmReason::windows);
  alarms.explained(8, K::model_gap, K::model_gap, 0.0);
  CHECK(alarms.alarm(K::stiction).active());
  CHECK(alarms.alarm(K::model_gap).active());
}

TEST_CASE("an alarm that is not raised is not explained, and a shelved alarm is off afterwards",
          "[monitor][alarm]") {
  LoopAlarms alarms = healthy();
  CHECK(alarms.explained(1, K::stiction, K::model_gap, 0.0).empty());
  alarms.window_judged(2, with({{K::stiction, 5.0}}));
  REQUIRE(alarms.act(K::stiction, AlarmAction::shelve, 3, 60000).accepted);
  alarms.explained(4, K::stiction, K::model_gap, 0.0);
  CHECK(alarms.alarm(K::stiction).state() == S::normal);
  CHECK(alarms.alarm(K::model_gap).state() == S::unacknowledged);
}

}  // namespace loop_alarms_test
