// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/corrective_action.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace corrective_action_test {

using namespace loopwarden::monitor;
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

// Windows with this error, the valve sticking; the last step that changed something.
CorrectiveStep windows(CorrectiveAction& action, int count, const WindowMeasures& m,
                       bool came = false) {
  CorrectiveStep last;
  for (int i = 0; i < count; ++i) {
    const CorrectiveStep step = action.window(m, true, came && i == 0);
    if (step.changed()) last = step;
  }
  return last;
}

constexpr int kWait = kBaseline;

CorrectiveAction trying(double rms = 10.0, double mean = 0.0) {
  CorrectiveAction action({.enabled = true, .allowed_mean_error_percent = 1.0});
  CHECK(windows(action, kWait, errors(rms, mean), true).order == Order::on);
  CHECK(action.state() == State::trying);
  return action;
}

constexpr int kDecision = static_cast<int>(kSettling + kTrial);

}  // namespace

TEST_CASE("corrective action is off unless it is asked for", "[monitor][corrective]") {
  CorrectiveAction action;
  CHECK_FALSE(windows(action, 20, errors(10.0), true).changed());
  CHECK_FALSE(action.veto(Veto::back).changed());
  CHECK(action.state() == State::off);
}

TEST_CASE("the jacket is switched on for an alarm that comes, from a steady baseline",
          "[monitor][corrective]") {
  CorrectiveAction action({.enabled = true});
  // Sticking since before: no reason to act.
  CHECK_FALSE(windows(action, 10, errors(10.0)).changed());
  // Set points that move are no baseline.
  CorrectiveAction moving({.enabled = true});
  CHECK_FALSE(windows(moving, 10, errors(10.0, 0.0, 5.0), true).changed());
  CHECK_FALSE(windows(moving, kWait - 1, errors(3.0, 4.0)).changed());
  const CorrectiveStep step = windows(moving, 1, errors(3.0, 4.0));
  CHECK(step.order == Order::on);
  CHECK(step.rms_before == Approx(5.0));
  CHECK(step.mean_before == Approx(4.0));
}

TEST_CASE("what the error does after the settling decides", "[monitor][corrective]") {
  CorrectiveAction action = trying(10.0, 0.2);
  CHECK_FALSE(windows(action, kSettling, errors(50.0)).changed());
  CHECK_FALSE(windows(action, kTrial - 1, errors(9.0)).changed());
  SECTION("it fell") {
    const CorrectiveStep step = windows(action, 1, errors(9.0));
    CHECK(step.to == State::helping);
    CHECK(step.order == Order::none);
    CHECK(step.rms_after == Approx(9.0));
    SECTION("and goes on falling") {
      CHECK_FALSE(windows(action, 3 * kTrial, errors(9.0)).changed());
      CHECK(action.acting());
    }
    SECTION("and rises again") {
      CHECK(windows(action, kTrial, errors(9.8)).order == Order::back);
      CHECK(action.state() == State::given_up);
    }
  }
  SECTION("it did not fall enough") {
    const CorrectiveStep step = windows(action, 1, errors(9.0 + 0.6 * static_cast<double>(kTrial)));
    CHECK(step.order == Order::back);
    CHECK(step.to == State::given_up);
    // Not again for this alarm, whatever comes.
    CHECK_FALSE(windows(action, 20, errors(20.0)).changed());
    // The valve is repaired, and sticks once more.
    CHECK(action.window(errors(1.0), false, false).to == State::waiting);
    CHECK(windows(action, kWait, errors(10.0), true).order == Order::on);
  }
}

TEST_CASE("a mean error that grows beyond what is allowed ends it", "[monitor][corrective]") {
  for (const double before : {0.0, 3.0}) {
    for (const double after : {0.9, 1.1, 2.9, 3.1}) {
      CorrectiveAction action = trying(10.0, before);
      const CorrectiveStep step = windows(action, kDecision, errors(5.0, -after));
      INFO(before << " then " << after);
      CHECK((step.to == State::helping) == (after <= (before > 1.0 ? before : 1.0)));
    }
  }
}

TEST_CASE("repair, manual, bad PV and the operator each bring the jacket back",
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
  SECTION("a window that is not fit is only another beginning") {
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
  SECTION("set by hand: it stays as the operator wants it") {
    const CorrectiveStep step = action.veto(Veto::hands_off);
    CHECK(step.order == Order::none);
    CHECK(step.to == State::vetoed);
  }
}

TEST_CASE("an order that the loop refuses ends it for this alarm", "[monitor][corrective]") {
  CorrectiveAction action = trying();
  const CorrectiveStep step = action.refused();
  CHECK(step.to == State::given_up);
  CHECK(step.order == Order::none);  // it is not on: nothing to take back
  CHECK_FALSE(windows(action, 3 * kDecision, errors(10.0)).changed());
  // Whoever orders nothing can't be refused.
  CHECK_FALSE(action.refused().changed());
  CHECK(action.window(errors(10.0), false, false).to == State::waiting);
}

TEST_CASE("a reload begins it anew where it acts, and nowhere else", "[monitor][corrective]") {
  CorrectiveAction action = trying();
  SECTION("trying") {}
  SECTION("helping") {
    windows(action, kDecision, errors(5.0));
    REQUIRE(action.state() == State::helping);
  }
  const CorrectiveStep step = action.reloaded();
  CHECK(step.to == State::waiting);
  CHECK(step.order == Order::back);  // an order to act may still be underway
  CHECK_FALSE(windows(action, kWait - 1, errors(10.0)).changed());
  CHECK(windows(action, 1, errors(10.0)).order == Order::on);
  windows(action, kDecision, errors(10.0));
  REQUIRE(action.state() == State::given_up);
  CHECK_FALSE(action.reloaded().changed());
  CHECK_FALSE(CorrectiveAction().reloaded().changed());
}

}  // namespace corrective_action_test
