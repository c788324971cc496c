// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/corrective_action.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "model/alarm/limits.hpp"

namespace corrective_action_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using Order = CorrectiveStep::Order;
using State = CorrectiveState;

namespace {

WindowMeasures errors(double variability, double mean = 0.0, double set_point_range = 0.0) {
  WindowMeasures m;
  m.variability_percent = variability;
  m.mean_error_percent = mean;
  m.set_point_range_percent = set_point_range;
  return m;
}

// Adds windows with this error of a sticking valve; returns the last step that changed something.
CorrectiveStep windows(CorrectiveAction& action, int count, const WindowMeasures& m,
                       bool came = false) {
  CorrectiveStep last;
  for (int i = 0; i < count; ++i) {
    const CorrectiveStep step = action.window(m, true, came && i == 0);
    if (step.changed()) last = step;
  }
  return last;
}

constexpr int kWait = AlarmLimits::kBaseline;

CorrectiveAction trying(double rms = 10.0, double mean = 0.0) {
  CorrectiveAction action({.enabled = true, .allowed_mean_error_percent = 1.0});
  CHECK(windows(action, kWait, errors(rms, mean), true).order == Order::on);
  CHECK(action.state() == State::trying);
  return action;
}

constexpr int kDecision = static_cast<int>(AlarmLimits::kSettling + AlarmLimits::kTrial);

}  // namespace

TEST_CASE("corrective action is off by default", "[monitor][corrective]") {
  CorrectiveAction action;
  CHECK_FALSE(windows(action, 20, errors(10.0), true).changed());
  CHECK_FALSE(action.veto(Veto::back).changed());
  CHECK(action.state() == State::off);
}

TEST_CASE("the jacket is switched on for a newly raised alarm, from a steady baseline",
          "[monitor][corrective]") {
  CorrectiveAction action({.enabled = true});
  // Sticking since earlier: no reason to act.
  CHECK_FALSE(windows(action, 10, errors(10.0)).changed());
  // Moving set points give no baseline.
  CorrectiveAction moving({.enabled = true});
  CHECK_FALSE(windows(moving, 10, errors(10.0, 0.0, 5.0), true).changed());
  CHECK_FALSE(windows(moving, kWait - 1, errors(3.0, 4.0)).changed());
  const CorrectiveStep step = windows(moving, 1, errors(3.0, 4.0));
  CHECK(step.order == Order::on);
  CHECK(step.rms_before == Approx(5.0));
  CHECK(step.mean_before == Approx(4.0));
}

TEST_CASE("the error after the settling decides", "[monitor][corrective]") {
  CorrectiveAction action = trying(10.0, 0.2);
  CHECK_FALSE(windows(action, AlarmLimits::kSettling, errors(50.0)).changed());
  CHECK_FALSE(windows(action, AlarmLimits::kTrial - 1, errors(9.0)).changed());
  SECTION("it fell") {
    const CorrectiveStep step = windows(action, 1, errors(9.0));
    CHECK(step.to == State::helping);
    CHECK(step.order == Order::none);
    CHECK(step.rms_after == Approx(9.0));
    SECTION("and continues to fall") {
      CHECK_FALSE(windows(action, 3 * AlarmLimits::kTrial, errors(9.0)).changed());
      CHECK(action.acting());
    }
    SECTION("and rises again") {
      CHECK(windows(action, AlarmLimits::kTrial, errors(9.8)).order == Order::back);
      CHECK(action.state() == State::given_up);
    }
  }
  SECTION("it did not fall enough") {
    const CorrectiveStep step =
        windows(action, 1, errors(9.0 + 0.6 * static_cast<double>(AlarmLimits::kTrial)));
    CHECK(step.order == Order::back);
    CHECK(step.to == State::given_up);
    // Not again for this alarm, under any condition.
    CHECK_FALSE(windows(action, 20, errors(20.0)).changed());
    // The valve is repaired, and sticks once more.
    CHECK(action.window(errors(1.0), false, false).to == State::waiting);
    CHECK(windows(action, kWait, errors(10.0), true).order == Order::on);
  }
}

TEST_CASE("a mean error that grows beyond the limit ends it", "[monitor][corrective]") {
  for (const double before : {0.0, 3.0}) {
    for (const double after : {0.9, 1.1, 2.9, 3.1}) {
      CorrectiveAction action = trying(10.0, before);
      const CorrectiveStep step = windows(action, kDecision, errors(5.0, -after));
      INFO(before << " then " << after);
      CHECK((step.to == State::helping) == (after <= (before > 1.0 ? before : 1.0)));
    }
  }
}

TEST_CASE("repair, manual, bad PV and the operator each withdraw the jacket",
          "[monitor][corrective]") {
  CorrectiveAction action = trying();
  SECTION("repaired") {
    const CorrectiveStep step = action.window(errors(5.0), false, false);
    CHECK(step.order == Order::back);
    CHECK(step.to == State::waiting);
    CHECK_FALSE(windows(action, 10, errors(5.0)).changed());
  }
  SECTION("not in automatic: it waits for another baseline") {
    CHECK(action.interrupted(false).order == Order::back);
    CHECK_FALSE(windows(action, kWait - 1, errors(10.0)).changed());
    CHECK(windows(action, 1, errors(10.0)).order == Order::on);
  }
  SECTION("an unusable window is only another beginning") {
    windows(action, kDecision - 1, errors(5.0));
    CHECK_FALSE(action.interrupted(true).changed());
    CHECK_FALSE(windows(action, kDecision - 1, errors(5.0)).changed());
    CHECK(windows(action, 1, errors(5.0)).to == State::helping);
  }
  SECTION("vetoed") {
    CHECK(action.veto(Veto::back).order == Order::back);
    CHECK(action.state() == State::vetoed);
    CHECK_FALSE(action.veto(Veto::back).changed());
    CHECK_FALSE(windows(action, 20, errors(10.0), true).changed());
    CHECK(action.veto(Veto::none).to == State::waiting);
    CHECK(windows(action, kWait, errors(10.0)).order == Order::on);
  }
  SECTION("set manually: it stays as the operator wants it") {
    const CorrectiveStep step = action.veto(Veto::hands_off);
    CHECK(step.order == Order::none);
    CHECK(step.to == State::vetoed);
    SECTION("a veto on top of it has an effect") {
      CHECK(action.veto(Veto::back).order == Order::back);
      CHECK(action.state() == State::vetoed);
    }
    SECTION("the jacket doesn't act without supervision when the veto is lifted") {
      CHECK(action.veto(Veto::none).order == Order::back);
      CHECK(action.state() == State::waiting);
      CHECK(windows(action, kWait, errors(10.0)).order == Order::on);
    }
  }
  SECTION("commissioned") {
    const CorrectiveStep begun = action.veto(Veto::commissioning);
    CHECK(begun.order == Order::back);
    CHECK(std::string(begun.why).find("operator") == std::string::npos);
    CHECK_FALSE(action.veto(Veto::commissioning).changed());
    const CorrectiveStep ended = action.veto(Veto::none);
    CHECK(ended.to == State::waiting);
    CHECK(std::string(ended.why).find("operator") == std::string::npos);
    CHECK(windows(action, kWait, errors(10.0)).order == Order::on);
    SECTION("the end of sticking, a bad PV and a veto withdraw it afterwards as well") {
      CorrectiveAction repaired = action, bad = action, vetoed = action;
      CHECK(repaired.window(errors(5.0), false, false).order == Order::back);
      CHECK(bad.interrupted(false).order == Order::back);
      CHECK(vetoed.veto(Veto::back).order == Order::back);
    }
  }
  SECTION("an operator's veto during a commissioning stays after it") {
    action.veto(Veto::commissioning);
    CHECK_FALSE(action.veto(Veto::back).order == Order::on);
    CHECK(action.state() == State::vetoed);
    CHECK_FALSE(windows(action, 20, errors(10.0), true).changed());
  }
}

TEST_CASE("a command that the loop refuses ends it for this alarm", "[monitor][corrective]") {
  CorrectiveAction action = trying();
  const CorrectiveStep step = action.refused();
  CHECK(step.to == State::given_up);
  CHECK(step.order == Order::none);  // it is not on and needs no withdrawal
  CHECK_FALSE(windows(action, 3 * kDecision, errors(10.0)).changed());
  // An action without a request can't be refused.
  CHECK_FALSE(action.refused().changed());
  CHECK(action.window(errors(10.0), false, false).to == State::waiting);
}

TEST_CASE("a reload restarts it if it acts, and only then", "[monitor][corrective]") {
  CorrectiveAction action = trying();
  SECTION("trying") {}
  SECTION("helping") {
    windows(action, kDecision, errors(5.0));
    REQUIRE(action.state() == State::helping);
  }
  const CorrectiveStep step = action.reloaded();
  CHECK(step.to == State::waiting);
  CHECK(step.order == Order::back);  // a command to act may still be underway
  CHECK_FALSE(windows(action, kWait - 1, errors(10.0)).changed());
  CHECK(windows(action, 1, errors(10.0)).order == Order::on);
  windows(action, kDecision, errors(10.0));
  REQUIRE(action.state() == State::given_up);
  CHECK_FALSE(action.reloaded().changed());
  CHECK_FALSE(CorrectiveAction().reloaded().changed());
}

namespace {

using loopwarden::control::DisengageReason;
using loopwarden::control::MovePhase;
using loopwarden::control::MovesState;

CorrectiveSettings planned(bool on_order = false) {
  return {.enabled = true, .form = CorrectiveForm::planned_moves, .on_order = on_order};
}

MovesState in_shadow(double gain) {
  return {.phase = MovePhase::resting, .gain = gain, .shadow = true};
}

MovesState ended(DisengageReason reason, bool shadow = false, bool latched = true) {
  return {.phase = MovePhase::disengaged, .reason = reason, .latched = latched, .shadow = shadow};
}

// In shadow, after a baseline with this RMS.
CorrectiveAction shadowing(double rms = 10.0, bool may_act = true) {
  CorrectiveAction action(planned());
  action.explained(may_act);
  CHECK(windows(action, 1, errors(rms)).order == Order::shadow);
  CHECK(action.state() == State::in_shadow);
  windows(action, AlarmLimits::kLeastBaseline, errors(rms));
  return action;
}

CorrectiveAction calming(double rms = 10.0) {
  CorrectiveAction action = shadowing(rms);
  CHECK(action.moves(in_shadow(0.2), AlarmLimits::kShadow_s).order == Order::on);
  CHECK(action.calms());
  return action;
}

}  // namespace

TEST_CASE("planned moves wait for the explanation, and for ten minutes in shadow",
          "[monitor][corrective]") {
  CorrectiveAction action(planned());
  CHECK_FALSE(windows(action, 3 * kWait, errors(10.0), true).changed());
  action.explained(true);
  const CorrectiveStep begin = windows(action, 1, errors(10.0));
  CHECK(begin.order == Order::shadow);
  CHECK(begin.form == CorrectiveForm::planned_moves);
  CHECK_FALSE(action.calms());
  windows(action, 12, errors(10.0, 1.0));
  CHECK_FALSE(action.moves(in_shadow(0.3), AlarmLimits::kShadow_s - 1.0).changed());
  SECTION("it gains: they act") {
    const CorrectiveStep step = action.moves(in_shadow(0.3), 1.0);
    CHECK(step.to == State::trying);
    CHECK(step.order == Order::on);
    CHECK(step.gain_in_shadow == 0.3);
    CHECK(step.rms_before == Approx(std::hypot(10.0, 1.0)));
  }
  SECTION("it gains nothing") {
    CHECK(action.moves(in_shadow(0.96), 1.0).to == State::given_up);
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
    action.explained(true);  // for the same alarm
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
  }
  SECTION("its gain is not known yet") {
    CHECK_FALSE(action.moves(in_shadow(0.0), 100.0).changed());
    CHECK(action.moves(in_shadow(0.3), 100.0).order == Order::on);
  }
  SECTION("given back in shadow") {
    CHECK_FALSE(action.moves(ended(DisengageReason::stem_stuck, true, false), 1.0).changed());
    const CorrectiveStep step = action.moves(ended(DisengageReason::no_gain, true), 1.0);
    CHECK(step.to == State::given_up);
    CHECK(step.order == Order::back);
  }
  SECTION("a set point that always moves is no baseline") {
    CorrectiveAction moving(planned());
    moving.explained(true);
    windows(moving, 20, errors(10.0, 0.0, 5.0));
    CHECK_FALSE(moving.moves(in_shadow(0.3), 2.0 * AlarmLimits::kShadow_s).changed());
  }
}

TEST_CASE("planned moves with a roughly known valve stay in shadow", "[monitor][corrective]") {
  CorrectiveAction action = shadowing(10.0, false);
  CHECK_FALSE(action.moves(in_shadow(0.2), 10.0 * AlarmLimits::kShadow_s).changed());
  CHECK(action.state() == State::in_shadow);
}

TEST_CASE("planned moves in shadow restart with a new explanation of the alarm",
          "[monitor][corrective]") {
  CorrectiveAction action = shadowing(10.0, false);
  CHECK_FALSE(action.moves(in_shadow(0.2), AlarmLimits::kShadow_s).changed());
  const CorrectiveStep step = action.explained(true);
  CHECK(step.order == Order::shadow);
  CHECK(step.to == State::in_shadow);
  windows(action, AlarmLimits::kLeastBaseline, errors(10.0));
  CHECK_FALSE(action.moves(in_shadow(0.2), AlarmLimits::kShadow_s - 1.0).changed());
  CHECK(action.moves(in_shadow(0.2), 1.0).order == Order::on);
  SECTION("acting: kept for the next beginning") {
    CHECK_FALSE(action.explained(false).changed());
    CHECK(action.interrupted(false).order == Order::back);
    CHECK(windows(action, 1, errors(10.0)).order == Order::shadow);
    windows(action, AlarmLimits::kLeastBaseline, errors(10.0));
    CHECK(action.state() == State::in_shadow);
    CHECK_FALSE(action.moves(in_shadow(0.2), 10.0 * AlarmLimits::kShadow_s).changed());
  }
}

TEST_CASE("planned moves are withdrawn if the newest explanation is another one",
          "[monitor][corrective]") {
  SECTION("offered") {
    CorrectiveAction action(planned(true));
    action.explained(true);
    CHECK(windows(action, 1, errors(10.0)).to == State::offered);
    const CorrectiveStep step = action.explained_otherwise();
    CHECK(step.to == State::waiting);
    CHECK(step.order == Order::none);
    CHECK_FALSE(action.ordered().changed());
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
  }
  SECTION("in shadow") {
    CorrectiveAction action = shadowing();
    CHECK(action.explained_otherwise().order == Order::back);
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
  }
  SECTION("acting: their own checks watch them") {
    CorrectiveAction action = calming();
    CHECK_FALSE(action.explained_otherwise().changed());
    CHECK(action.calms());
  }
}

TEST_CASE("planned moves that are only offered begin at a person's command",
          "[monitor][corrective]") {
  CorrectiveAction action(planned(true));
  CHECK_FALSE(action.ordered().changed());
  action.explained(true);
  const CorrectiveStep offered = windows(action, 1, errors(10.0));
  CHECK(offered.to == State::offered);
  CHECK(offered.order == Order::none);
  CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
  SECTION("ordered") {
    CHECK(action.ordered().order == Order::shadow);
    CHECK_FALSE(action.ordered().changed());
    // Restarted after manual without another request: it was for this alarm.
    CHECK(action.interrupted(false).order == Order::back);
    CHECK(windows(action, 1, errors(10.0)).order == Order::shadow);
  }
  SECTION("a command is for one act: after a veto they are only offered again") {
    REQUIRE(action.ordered().order == Order::shadow);
    CHECK(action.veto(Veto::hands_off).to == State::vetoed);
    CHECK(action.veto(Veto::none).to == State::waiting);
    const CorrectiveStep again = windows(action, 20, errors(10.0));
    CHECK(action.state() == State::offered);
    CHECK(again.order == Order::none);
  }
  SECTION("the alarm cleared") {
    CHECK(action.window(errors(1.0), false, false).to == State::waiting);
    CHECK_FALSE(action.ordered().changed());
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
  }
}

TEST_CASE("planned moves are judged by RMS before and after, and by their own checks",
          "[monitor][corrective]") {
  CorrectiveAction action = calming(10.0);
  SECTION("RMS fell; the remaining error is within it") {
    const CorrectiveStep step = windows(action, kDecision, errors(1.0, 4.0));
    CHECK(step.to == State::helping);
    CHECK(step.rms_after == Approx(std::hypot(1.0, 4.0)));
  }
  SECTION("RMS did not fall") {
    CHECK(windows(action, kDecision, errors(9.6)).order == Order::back);
    CHECK(action.state() == State::given_up);
  }
  SECTION("repaired: not again before another alarm is explained") {
    windows(action, kDecision, errors(1.0));
    const CorrectiveStep step = action.moves(ended(DisengageReason::valve_follows), 1.0);
    CHECK(step.order == Order::back);
    CHECK(step.to == State::waiting);
    CHECK_FALSE(windows(action, 20, errors(1.0)).changed());
    action.explained(true);
    CHECK(windows(action, 1, errors(10.0)).order == Order::shadow);
  }
  SECTION("given back") {
    CHECK(action.moves(ended(DisengageReason::no_gain), 1.0).to == State::given_up);
  }
  SECTION("disengaged: in shadow once more for a time, and given up the third time") {
    for (int time = 1; time <= AlarmLimits::kMostDisengaged; ++time) {
      const CorrectiveStep step =
          action.moves(ended(DisengageReason::contradiction, false, false), 1.0);
      CHECK(step.order == Order::back);
      CHECK(std::string(step.why).find("contradict") != std::string::npos);
      CHECK(step.to == (time < AlarmLimits::kMostDisengaged ? State::waiting : State::given_up));
      if (time == AlarmLimits::kMostDisengaged) break;
      CHECK(windows(action, 1, errors(10.0)).order == Order::shadow);
      windows(action, AlarmLimits::kLeastBaseline, errors(10.0));
      REQUIRE(action.moves(in_shadow(0.4), AlarmLimits::kShadow_s).to == State::trying);
    }
  }
  SECTION("what the shadow did before is of no account") {
    CHECK_FALSE(action.moves(ended(DisengageReason::no_gain, true), 1.0).changed());
  }
  SECTION("vetoed, and the veto lifted: the valve is still known") {
    CHECK(action.veto(Veto::back).order == Order::back);
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
    action.veto(Veto::none);
    CHECK(windows(action, 1, errors(10.0)).order == Order::shadow);
  }
  SECTION("a reload") {
    CHECK(action.reloaded().order == Order::back);
    CHECK(windows(action, 1, errors(10.0)).order == Order::shadow);
  }
  SECTION("refused") {
    const CorrectiveStep step = action.refused();
    CHECK(step.to == State::given_up);
    CHECK(step.order == Order::back);
    CHECK_FALSE(windows(action, 20, errors(10.0)).changed());
  }
}

}  // namespace corrective_action_test
