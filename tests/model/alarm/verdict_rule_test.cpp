// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/verdict_rule.hpp"

#include <catch2/catch.hpp>

#include "model/watch/specialist_judge.hpp"

namespace verdict_rule_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;

namespace {

WindowJudgement fault(AlarmKind kind, double p, double severity = 5.0) {
  WindowJudgement j;
  j.result = WindowJudgement::Result::fault;
  j.fault = kind;
  j.probability[index_of(kind)] = p;
  j.severity_percent = severity;
  return j;
}
WindowJudgement healthy() { return {}; }
WindowJudgement quiet() {
  WindowJudgement j;
  j.result = WindowJudgement::Result::not_enough_movement;
  j.probability.fill(0.2);
  return j;
}
bool on(const VerdictRule& rule, AlarmKind kind) { return rule.conditions()[index_of(kind)].on; }

}  // namespace

TEST_CASE("three of five windows raise, and quiet ones in between do not count", "[monitor]") {
  VerdictRule rule;
  rule.add(fault(AlarmKind::stiction, 0.9, 4.0));
  rule.add(healthy());
  rule.add(fault(AlarmKind::stiction, 0.9, 5.0));
  rule.add(quiet());
  rule.add(quiet());
  rule.add(quiet());
  CHECK_FALSE(on(rule, AlarmKind::stiction));
  rule.add(fault(AlarmKind::stiction, 0.9, 6.0));
  CHECK(on(rule, AlarmKind::stiction));
  CHECK(rule.conditions()[index_of(AlarmKind::stiction)].severity_percent == 5.0);
  CHECK_FALSE(on(rule, AlarmKind::backlash));
}

TEST_CASE("windows that lie too far back do not count", "[monitor]") {
  VerdictRule rule;
  rule.add(fault(AlarmKind::backlash, 0.9));
  rule.add(fault(AlarmKind::backlash, 0.9));
  for (int i = 0; i < 4; ++i) rule.add(healthy());
  rule.add(fault(AlarmKind::backlash, 0.9));
  CHECK_FALSE(on(rule, AlarmKind::backlash));
}

TEST_CASE("a name below the threshold raises no alarm, and another name neither", "[monitor]") {
  VerdictRule rule;
  for (int i = 0; i < 10; ++i) rule.add(fault(AlarmKind::hysteresis, 0.49));
  CHECK_FALSE(on(rule, AlarmKind::hysteresis));
  for (int i = 0; i < 2; ++i) {
    rule.add(fault(AlarmKind::stiction, 0.9));
    rule.add(fault(AlarmKind::backlash, 0.9));
  }
  CHECK_FALSE(on(rule, AlarmKind::stiction));
  CHECK_FALSE(on(rule, AlarmKind::backlash));
}

TEST_CASE("a condition clears when the windows have forgotten it, not before", "[monitor]") {
  VerdictRule rule;
  for (int i = 0; i < 5; ++i) rule.add(fault(AlarmKind::low_air_supply, 0.9));
  REQUIRE(on(rule, AlarmKind::low_air_supply));
  for (int i = 0; i < 50; ++i) rule.add(quiet());
  CHECK(on(rule, AlarmKind::low_air_supply));
  // Healthy, but with a probability above the lower threshold.
  WindowJudgement suspicious = healthy();
  suspicious.probability[index_of(AlarmKind::low_air_supply)] = 0.35;
  for (int i = 0; i < 10; ++i) rule.add(suspicious);
  CHECK(on(rule, AlarmKind::low_air_supply));
  for (int i = 0; i < 3; ++i) rule.add(healthy());
  CHECK(on(rule, AlarmKind::low_air_supply));
  rule.add(healthy());
  CHECK_FALSE(on(rule, AlarmKind::low_air_supply));
  CHECK(rule.conditions()[index_of(AlarmKind::low_air_supply)].severity_percent == 0.0);
}

TEST_CASE("the daemon's rule needs fifteen windows to accept a repair", "[monitor]") {
  VerdictRule rule(kAlarmRule);
  for (int i = 0; i < 3; ++i) rule.add(fault(AlarmKind::stiction, 0.9));
  REQUIRE(on(rule, AlarmKind::stiction));
  // A sticking valve may look healthy for a while: two in fifteen keep the alarm.
  for (int round = 0; round < 4; ++round) {
    for (int i = 0; i < 6; ++i) rule.add(healthy());
    rule.add(fault(AlarmKind::stiction, 0.9));
    CHECK(on(rule, AlarmKind::stiction));
  }
  for (int i = 0; i < 7; ++i) rule.add(healthy());
  CHECK(on(rule, AlarmKind::stiction));
  rule.add(healthy());
  CHECK_FALSE(on(rule, AlarmKind::stiction));
  // Only the newest five raise an alarm.
  rule.add(fault(AlarmKind::stiction, 0.9));
  CHECK_FALSE(on(rule, AlarmKind::stiction));
}

TEST_CASE("a restart forgets windows and keeps conditions; one can be restored", "[monitor]") {
  VerdictRule rule;
  rule.add(fault(AlarmKind::stiction, 0.9));
  rule.add(fault(AlarmKind::stiction, 0.9));
  rule.restart();
  rule.add(fault(AlarmKind::stiction, 0.9));
  CHECK_FALSE(on(rule, AlarmKind::stiction));
  rule.restore(AlarmKind::backlash, true, 3.0);
  CHECK(on(rule, AlarmKind::backlash));
  // Too few windows to clear it.
  for (int i = 0; i < 3; ++i) rule.add(healthy());
  CHECK(on(rule, AlarmKind::backlash));
  rule.add(healthy());
  CHECK_FALSE(on(rule, AlarmKind::backlash));
}

TEST_CASE("the size of an alarm is the median of the windows that name it", "[monitor]") {
  VerdictRule rule(kAlarmRule);
  const auto severity = [&] {
    return rule.conditions()[index_of(AlarmKind::stiction)].severity_percent;
  };
  // Windows of a valve with a stick band of 6.5 %.
  const std::array sizes{6.7, 3.3, 5.9, 6.1, 20.2, 3.6, 79.3, 8.6, 6.1};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    rule.add(fault(AlarmKind::stiction, 0.9, sizes[i]));
    rule.add(quiet());
    INFO(i << ": " << severity());
    if (i >= 2) CHECK(severity() == Approx(6.1).margin(0.4));
  }
  // The windows of another fault don't count for this one, nor does a doubtful window.
  rule.add(fault(AlarmKind::backlash, 0.9, 50.0));
  rule.add(fault(AlarmKind::stiction, 0.4, 50.0));
  CHECK(severity() == Approx(6.1));
  // The size follows a growing fault once most windows agree.
  for (int i = 0; i < 8; ++i) rule.add(fault(AlarmKind::stiction, 0.9, 12.0));
  CHECK(severity() == Approx(12.0));
  // A few windows, as after a restart, keep the severity.
  rule.restart();
  rule.add(fault(AlarmKind::stiction, 0.9, 90.0));
  rule.add(fault(AlarmKind::stiction, 0.9, 90.0));
  CHECK(severity() == Approx(12.0));
}

TEST_CASE("settings are brought within their ranges", "[monitor]") {
  const VerdictRule rule({.windows = 99,
                          .windows_on = 0,
                          .windows_off = 7,
                          .probability_on = 0.4,
                          .probability_off = 0.9});
  CHECK(rule.settings().windows == kMostVotes);
  CHECK(rule.settings().windows_on == 1);
  CHECK(rule.settings().windows_off == 0);
  CHECK(rule.settings().probability_off == 0.4);
}

TEST_CASE("a verdict becomes a judgement with its fault's probability", "[monitor]") {
  using namespace loopwarden::specialist;
  WindowVerdict v;
  v.verdict = VerdictName::hysteresis;
  v.severity_percent = 7.0;
  v.mse = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  v.probabilities = {0.02, 0.03, 0.15, 0.7, 0.06, 0.04};
  const WindowJudgement j = judgement_of(v);
  CHECK(judgement_of(v).errors == v.mse);
  CHECK(j.result == WindowJudgement::Result::fault);
  CHECK(j.fault == AlarmKind::hysteresis);
  CHECK(j.severity_percent == 7.0);
  CHECK(j.probability[index_of(AlarmKind::hysteresis)] == 0.7);
  CHECK(j.probability[index_of(AlarmKind::stiction)] == 0.03);
  CHECK(j.probability[index_of(AlarmKind::unknown)] == 0.04);
  v.verdict = VerdictName::no_fault;
  CHECK(judgement_of(v).result == WindowJudgement::Result::no_fault);
  v.verdict = VerdictName::not_enough_movement;
  CHECK(judgement_of(v).result == WindowJudgement::Result::not_enough_movement);
  v.verdict = VerdictName::unknown;
  CHECK(judgement_of(v).fault == AlarmKind::unknown);
}

}  // namespace verdict_rule_test
