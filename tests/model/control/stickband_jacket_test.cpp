// SPDX-License-Identifier: Apache-2.0
#include "model/control/stickband_jacket.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "model/numeric/random.hpp"

namespace stickband_jacket_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod = 0.1;  // s
constexpr double kKi = 0.04;     // CO units / (PV unit s)
constexpr double kDeadZone = 0.05;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

JacketSettings settings(JacketForm form, double gain_per_s = 1.0) {
  return {.form = form, .gain_per_s = gain_per_s, .dead_zone = kDeadZone};
}

JacketInputs inputs(double error, double output, double position) {
  return {.error = error,
          .integral_rate = kKi * error,
          .output = output,
          .valve_position = position,
          .valve_position_valid = true};
}

// A stem at 5 V that sticks with `slip_error` while the output rises by 0.5 V, then jumps by 0.4 V.
// The error is still the old one, like in a process with dead time.
StickbandJacket after_slip(double slip_error, JacketSettings s = settings(JacketForm::dwell)) {
  StickbandJacket jacket(s, kPeriod);
  for (double output = 5.0; output < 5.5; output += 0.01) {
    jacket.step(inputs(slip_error, output, 5.0));
  }
  jacket.step(inputs(slip_error, 5.5, 5.4));
  return jacket;
}

// Returns the remaining share of the integral action at the position after the slip, once the
// output has reversed by 0.2 V and the stem has not followed. 1 is plain PI.
double share_left(StickbandJacket jacket, double error, double position = 5.4) {
  const double rate = jacket.step(inputs(error, 5.3, position));
  return 1.0 + rate / (kKi * error);
}

}  // namespace

TEST_CASE("off gives no correction", "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::off), kPeriod);
  CHECK(jacket.step(inputs(1.0, 6.0, 2.0)) == 0.0);
}

TEST_CASE("paper form feeds the whole difference back", "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::paper, 0.3), kPeriod);
  CHECK(jacket.step(inputs(0.5, 6.0, 5.0)) == Approx(-0.3));
  CHECK(jacket.step(inputs(0.5, 4.0, 5.0)) == Approx(0.3));
  CHECK(jacket.step(inputs(0.5, 5.02, 5.0)) == Approx(-0.006));  // no dead zone
}

TEST_CASE("paper form has an equilibrium off the set point at Ki e = Ks (u - u_valve)",
          "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::paper, 0.2), kPeriod);
  const double error = 1.5;
  const double difference = kKi * error / 0.2;
  CHECK(kKi * error + jacket.step(inputs(error, 5.0 + difference, 5.0)) ==
        Approx(0.0).margin(1e-12));
}

TEST_CASE("bounded form never takes more than half of the integral action", "[jacket]") {
  const double gain = GENERATE(0.01, 1.0, 100.0);
  StickbandJacket jacket(settings(JacketForm::bounded, gain), kPeriod);
  loopwarden::numeric::Random random(7);
  double largest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const JacketInputs in =
        inputs(random.uniform(-3.0, 3.0), random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
    const double rate = jacket.step(in);
    REQUIRE(std::abs(rate) <= std::abs(in.integral_rate) / 2.0);
    // always against the sign of the difference
    REQUIRE(rate * (in.output - in.valve_position) <= 0.0);
    largest = std::max(largest, std::abs(rate / in.integral_rate));
  }
  CHECK(largest == Approx(0.5));
}

TEST_CASE("bounded form is silent within the dead zone and starts from zero at its edge",
          "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::bounded, 1.0), kPeriod);
  const double error = GENERATE(-100.0, 100.0);
  CHECK(jacket.step(inputs(error, 5.049, 5.0)) == 0.0);
  CHECK(jacket.step(inputs(error, 4.951, 5.0)) == 0.0);
  CHECK(jacket.step(inputs(error, 5.06, 5.0)) == Approx(-0.01));
  CHECK(jacket.step(inputs(error, 4.94, 5.0)) == Approx(0.01));
}

TEST_CASE("an untrusted read-back switches every form off", "[jacket]") {
  const JacketForm form = GENERATE(JacketForm::paper, JacketForm::bounded);
  StickbandJacket jacket(settings(form), kPeriod);
  JacketInputs in = inputs(1.0, 6.0, 5.0);
  REQUIRE(jacket.step(in) != 0.0);
  in.valve_position_valid = false;
  CHECK(jacket.step(in) == 0.0);
  in.valve_position_valid = true;
  in.valve_position = kNan;
  CHECK(jacket.step(in) == 0.0);
  in.valve_position = std::numeric_limits<double>::infinity();
  CHECK(jacket.step(in) == 0.0);
  CHECK(jacket.step(inputs(1.0, 6.0, 5.0)) != 0.0);
}

TEST_CASE("dwell forgets the valve while its read-back is untrusted", "[jacket]") {
  StickbandJacket jacket = after_slip(1.0);
  JacketInputs bad = inputs(-0.3, 5.3, 5.4);
  SECTION("reported bad") { bad.valve_position_valid = false; }
  SECTION("not a number") { bad.valve_position = kNan; }
  CHECK(jacket.step(bad) == 0.0);
  CHECK(share_left(jacket, -0.3) == 1.0);
}

TEST_CASE("an error that is not a number gives no correction and leaves no trace", "[jacket]") {
  const JacketForm form = GENERATE(JacketForm::paper, JacketForm::bounded, JacketForm::dwell);
  StickbandJacket jacket(settings(form), kPeriod);
  CHECK(jacket.step(inputs(kNan, 6.0, 5.0)) == 0.0);
  CHECK(std::isfinite(jacket.mean_error()));
  CHECK(std::isfinite(jacket.step(inputs(1.0, 6.0, 5.0))));
}

TEST_CASE("dwell integrates slowly if the slip has halved the error", "[jacket]") {
  const double sign = GENERATE(-1.0, 1.0);
  const StickbandJacket jacket = after_slip(sign);
  CHECK(share_left(jacket, -0.02 * sign) == Approx(0.05));
  CHECK(share_left(jacket, -0.5 * sign) == Approx(0.05));
  CHECK(share_left(jacket, -0.6 * sign) == Approx(0.5));
  CHECK(share_left(jacket, -0.7 * sign) == Approx(1.0));
  CHECK(share_left(jacket, -1.0 * sign) == 1.0);
  CHECK(share_left(jacket, -5.0 * sign) == 1.0);
}

TEST_CASE("dwell leaves the integral unchanged until the slip has reversed the error", "[jacket]") {
  StickbandJacket jacket = after_slip(1.0);
  CHECK(share_left(jacket, 0.9) == 1.0);  // dead time: still the old error
  CHECK(share_left(jacket, 0.2) == 1.0);  // the loop moves to a new set point
}

TEST_CASE("dwell compares with the error before the slip, even if PV answers within a period",
          "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::dwell), kPeriod);
  for (double output = 5.0; output < 5.5; output += 0.01) jacket.step(inputs(1.0, output, 5.0));
  jacket.step(inputs(-0.4, 5.5, 5.4));
  CHECK(share_left(jacket, -0.4) == Approx(0.05));
}

TEST_CASE("dwell keeps the error of the slip while the stem slides on", "[jacket]") {
  StickbandJacket jacket = after_slip(1.0);
  jacket.step(inputs(0.2, 5.6, 5.5));
  CHECK(share_left(jacket, -0.3, 5.5) == Approx(0.05));
}

TEST_CASE("dwell learns from a stem that breaks loose after the output has reversed", "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::dwell), kPeriod);
  for (const double output : {5.0, 5.3, 5.02}) jacket.step(inputs(1.0, output, 5.0));
  jacket.step(inputs(1.0, 5.02, 5.2));
  CHECK(jacket.step(inputs(-0.3, 5.3, 5.2)) == Approx(0.95 * kKi * 0.3));
}

TEST_CASE("dwell treats both signs of a small error alike once it has crossed zero", "[jacket]") {
  // Otherwise noise would be integrated at two speeds and balance at an error.
  StickbandJacket jacket = after_slip(1.0);
  jacket.step(inputs(-0.1, 5.3, 5.4));
  CHECK(share_left(jacket, 0.05) == Approx(0.05));
  CHECK(share_left(jacket, -0.05) == Approx(0.05));
}

TEST_CASE("dwell is inactive until it has seen the valve stick and slip", "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::dwell), kPeriod);
  for (double output = 5.0; output < 6.0; output += 0.01) {
    REQUIRE(jacket.step(inputs(output < 5.5 ? 1.0 : -0.1, output, 5.0)) == 0.0);
  }
}

TEST_CASE("dwell is inactive while the valve follows", "[jacket]") {
  StickbandJacket jacket = after_slip(1.0);
  SECTION("stem and output move together, with a bias of the read-back") {
    for (double output = 5.5; output > 4.5; output -= 0.01) {
      REQUIRE(jacket.step(inputs(-0.1, output, output - 0.1)) == 0.0);
    }
  }
  SECTION("the output has not moved yet") {
    CHECK(jacket.step(inputs(-0.1, 5.5, 5.4)) == 0.0);
    CHECK(jacket.step(inputs(-0.1, 5.46, 5.4)) == 0.0);
  }
  SECTION("a slow stem still moves while the output has hardly reversed") {
    CHECK(jacket.step(inputs(-0.1, 5.47, 5.44)) == 0.0);
  }
  SECTION("both have moved by nearly the same") {
    CHECK(jacket.step(inputs(-0.1, 5.44, 5.36)) == 0.0);
  }
  SECTION("noise of the read-back beyond the dead zone counts as movement") {
    CHECK(share_left(jacket, -0.1, 5.46) == 1.0);
    CHECK(share_left(jacket, -0.1, 5.44) == Approx(0.05));
  }
}

TEST_CASE("dwell does not see a constant bias of the read-back", "[jacket]") {
  const double bias = GENERATE(-2.0, 0.3, 2.0);
  StickbandJacket straight(settings(JacketForm::dwell), kPeriod);
  StickbandJacket biased(settings(JacketForm::dwell), kPeriod);
  loopwarden::numeric::Random random(3);
  double stem = 5.0;
  bool acted = false;
  for (int i = 0; i < 5000; ++i) {
    const double output = 5.0 + 0.5 * std::sin(i * 0.01);
    if (std::abs(output - stem) > 0.4) stem = output;
    const double error = 5.1 - stem + 0.01 * random.normal();
    const double rate = straight.step(inputs(error, output, stem));
    REQUIRE(biased.step(inputs(error, output, stem + bias)) == rate);
    acted = acted || rate != 0.0;
  }
  CHECK(acted);
}

TEST_CASE("dwell always leaves a twentieth of the integral action, with its sign", "[jacket]") {
  StickbandJacket jacket(settings(JacketForm::dwell), kPeriod);
  loopwarden::numeric::Random random(11);
  double stem = 5.0;
  double least = 1.0;
  for (int i = 0; i < 20000; ++i) {
    const double output = 5.0 + random.uniform(-2.0, 2.0);
    if (std::abs(output - stem) > 1.5) stem = output;
    const JacketInputs in = inputs(random.uniform(-1.0, 1.0), output, stem);
    const double left = 1.0 + jacket.step(in) / in.integral_rate;
    REQUIRE(left <= 1.0);
    REQUIRE(left >= 0.05 - 1e-12);
    least = std::min(least, left);
  }
  CHECK(least == Approx(0.05));
}

TEST_CASE("the jacket pauses above the mean error limit and returns below half of it", "[jacket]") {
  JacketSettings s = settings(JacketForm::bounded);
  s.max_mean_error = 0.5;
  s.mean_error_time_s = 10.0;
  StickbandJacket jacket(s, kPeriod);
  const auto run = [&](double error, double seconds) {
    double rate = 0.0;
    for (int i = 0; i < static_cast<int>(seconds / kPeriod); ++i) {
      rate = jacket.step(inputs(error, 6.0, 5.0));
    }
    return rate;
  };
  CHECK(run(0.45, 100.0) != 0.0);
  CHECK_FALSE(jacket.standing_back());
  CHECK(run(0.55, 100.0) == 0.0);
  CHECK(jacket.standing_back());
  CHECK(jacket.mean_error() == Approx(0.55).epsilon(0.01));
  CHECK(run(0.3, 100.0) == 0.0);  // below the limit, not below half of it
  CHECK(run(0.2, 100.0) != 0.0);
  CHECK_FALSE(jacket.standing_back());
  CHECK(run(-0.6, 100.0) == 0.0);  // either sign
}

TEST_CASE("the mean error is a first-order mean", "[jacket]") {
  JacketSettings s = settings(JacketForm::dwell);
  s.mean_error_time_s = 20.0;
  StickbandJacket jacket(s, kPeriod);
  for (int i = 0; i < 200; ++i) jacket.step(inputs(1.0, 5.0, 5.0));  // one time constant
  CHECK(jacket.mean_error() == Approx(1.0 - std::exp(-1.0)).epsilon(0.01));
}

TEST_CASE("dwell keeps learning while it pauses", "[jacket]") {
  JacketSettings s = settings(JacketForm::dwell);
  s.max_mean_error = 0.02;
  s.mean_error_time_s = 1.0;
  StickbandJacket jacket = after_slip(1.0, s);
  REQUIRE(jacket.standing_back());
  CHECK(jacket.step(inputs(-0.3, 5.3, 5.4)) == 0.0);
  s.max_mean_error = 10.0;
  jacket.configure(s);
  CHECK(share_left(jacket, -0.3) == Approx(0.05));
}

TEST_CASE("another form restarts, other settings keep the learnt values", "[jacket]") {
  StickbandJacket jacket = after_slip(1.0);
  SECTION("shadow on") {
    JacketSettings s = settings(JacketForm::dwell);
    s.shadow = true;
    jacket.configure(s);
    CHECK(jacket.settings() == s);
    CHECK(share_left(jacket, -0.3) == Approx(0.05));
  }
  SECTION("through another form") {
    jacket.configure(settings(JacketForm::bounded));
    CHECK(jacket.mean_error() == 0.0);
    jacket.configure(settings(JacketForm::dwell));
    CHECK(share_left(jacket, -0.3) == 1.0);
  }
  SECTION("off, without a pause") {
    jacket.configure(settings(JacketForm::off));
    jacket.step(inputs(1.0, 5.5, 5.4));
    CHECK_FALSE(jacket.standing_back());
  }
  SECTION("reset") {
    jacket.reset();
    CHECK(share_left(jacket, -0.3) == 1.0);
  }
}

}  // namespace stickband_jacket_test
