// SPDX-License-Identifier: Apache-2.0
#include "model/control/pid.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace pid_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod = 0.1;  // s

PidSettings pi(double kp, double ki) {
  return {.gains = {.kp = kp, .ki = ki}, .output_low = 0.0, .output_high = 10.0};
}

struct Row {
  double sp, pv, co;
};

std::vector<Row> read_golden(const std::string& name) {
  std::ifstream file(std::string(LOOPWARDEN_SOURCE_DIR) + "/tests/golden/controller/" + name);
  REQUIRE(file);
  std::string line;
  std::getline(file, line);  // remark
  std::getline(file, line);
  REQUIRE(line == "time,sp,pv,co");
  std::vector<Row> rows;
  char comma = 0;
  double time = 0.0;
  for (Row row{}; std::getline(file, line); rows.push_back(row)) {
    std::istringstream fields(line);
    fields >> time >> comma >> row.sp >> comma >> row.pv >> comma >> row.co;
    REQUIRE(fields);
  }
  return rows;
}

// Saturates at 10 with a PV far below SP for `long_s`, then puts PV above SP and counts the seconds
// until the limited output leaves the limit.
double seconds_to_leave_the_limit(AntiWindup kind, double long_s) {
  PidSettings settings = pi(1.0, 0.5);
  settings.anti_windup = kind;
  settings.tracking_time_s = 1.0;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 5.0, 5.0);
  double out = 5.0;
  const auto step = [&](double pv) {
    out = std::clamp(pid.step(5.0, pv, out, 0.0), 0.0, 10.0);
    return out;
  };
  for (double t = 0.0; t < long_s; t += kPeriod) step(1.0);
  REQUIRE(out == 10.0);
  double t = 0.0;
  while (step(6.0) >= 10.0) t += kPeriod;
  return t;
}

}  // namespace

TEST_CASE("the positional law, calculated on paper", "[control][pid]") {
  Pid pid(pi(2.0, 0.5), kPeriod);
  pid.initialise(4.0, 3.0, 3.0);
  // e = 1: I = 4 + 0.5 * 1 * 0.1 = 4.05, u = 2 + 4.05
  CHECK(pid.step(3.0, 2.0, 4.0, 0.0) == Approx(6.05));
  // e = -0.5: I = 4.05 - 0.025, u = -1 + 4.025
  CHECK(pid.step(3.0, 3.5, 6.05, 0.0) == Approx(3.025));
  // An external rate is added to it: I = 4.025 + 0.1 * 0.7
  CHECK(pid.step(3.0, 3.0, 3.025, 0.7) == Approx(4.095));
}

TEST_CASE("direct action mirrors reverse action", "[control][pid]") {
  PidSettings direct = pi(2.0, 0.5);
  direct.action = Action::direct;
  Pid pid(direct, kPeriod);
  pid.initialise(4.0, 3.0, 3.0);
  CHECK(pid.error(3.0, 2.0) == -1.0);
  CHECK(pid.step(3.0, 2.0, 4.0, 0.0) == Approx(1.95));  // 4 - 0.05 - 2
}

TEST_CASE("recorded controllers are predicted to the converter's resolution", "[control][pid]") {
  struct Golden {
    const char* file;
    double kp, ki;
  };
  const auto golden = GENERATE(Golden{"sticky_valve.csv", 0.98216, 0.227437},
                               Golden{"biased_transmitter.csv", 1.53319, 0.178372});
  constexpr double kStep = 10.0 / 4096.0;
  const std::vector<Row> rows = read_golden(golden.file);
  REQUIRE(rows.size() == 2000);

  Pid pid(pi(golden.kp, golden.ki), kPeriod);
  pid.initialise(rows.front().co, rows.front().sp, rows.front().pv);
  double sum = 0.0;
  double worst = 0.0;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const double u = pid.step(rows[k].sp, rows[k].pv, rows[k - 1].co, 0.0);
    const double error = kStep * std::round(std::clamp(u, 0.0, 10.0) / kStep) - rows[k].co;
    sum += error * error;
    worst = std::max(worst, std::abs(error));
  }
  // The record begins with a CO that is itself rounded, so the integral is off by up to half a
  // step.
  CHECK(std::sqrt(sum / static_cast<double>(rows.size() - 1)) < 0.0015);
  CHECK(worst < 1.01 * kStep);
}

TEST_CASE("the integral is held within the span and never pushed", "[control][pid]") {
  Pid pid(pi(0.0, 1.0), 1.0);
  SECTION("it stops at the span, up and down") {
    pid.initialise(0.0, 0.0, 0.0);
    for (int k = 0; k < 50; ++k) pid.step(1.0, 0.0, 10.0, 0.0);
    CHECK(pid.integral() == 10.0);
    for (int k = 0; k < 50; ++k) pid.step(-1.0, 0.0, 0.0, 0.0);
    CHECK(pid.integral() == -10.0);
  }
  SECTION("an output that starts outside stays there, and may move inwards") {
    pid.initialise(14.0, 0.0, 0.0);
    CHECK(pid.step(0.0, 0.0, 14.0, 0.0) == 14.0);
    CHECK(pid.step(1.0, 0.0, 14.0, 0.0) == 14.0);
    CHECK(pid.step(-3.0, 0.0, 14.0, 0.0) == 11.0);
    CHECK(pid.step(1.0, 0.0, 11.0, 0.0) == 11.0);
    CHECK(pid.step(-3.0, 0.0, 11.0, 0.0) == 8.0);
    CHECK(pid.step(3.0, 0.0, 8.0, 0.0) == 10.0);
  }
}

TEST_CASE("anti-windup lets the output leave its limit soon", "[control][pid]") {
  const double clamped = seconds_to_leave_the_limit(AntiWindup::integral_clamp, 60.0);
  const double tracked = seconds_to_leave_the_limit(AntiWindup::back_calculation, 60.0);
  const double conditional = seconds_to_leave_the_limit(AntiWindup::conditional, 60.0);
  // Integral at 10 when PV crosses: u = -1 + 10 < 10 at once.
  CHECK(clamped == 0.0);
  // In balance the excess is Ki e Tt = 2, so that I = 12 - 4 = 8 when PV crosses.
  CHECK(tracked == 0.0);
  CHECK(conditional == 0.0);
  // Neither method depends on how long the saturation lasted.
  CHECK(seconds_to_leave_the_limit(AntiWindup::back_calculation, 600.0) == tracked);
  CHECK(seconds_to_leave_the_limit(AntiWindup::conditional, 600.0) == conditional);
}

TEST_CASE("back-calculation settles where the tracking balances the error", "[control][pid]") {
  PidSettings settings = pi(1.0, 0.5);
  settings.anti_windup = AntiWindup::back_calculation;
  settings.tracking_time_s = 2.0;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 5.0, 5.0);
  double u = 0.0;
  // A device downstream holds the output at 6: u - 6 = Ki e Tt.
  for (int k = 0; k < 1000; ++k) u = pid.step(5.0, 4.0, 6.0, 0.0);
  CHECK(u - 6.0 == Approx(0.5 * 1.0 * 2.0));

  SECTION("by default Tt is Ti") {
    settings.tracking_time_s = 0.0;
    pid.configure(settings);
    for (int k = 0; k < 1000; ++k) u = pid.step(5.0, 4.0, 6.0, 0.0);
    CHECK(u - 6.0 == Approx(1.0 * 1.0));  // Ki e Kp / Ki
  }
  SECTION("Tt is never below the period, so that it can't ring") {
    settings.tracking_time_s = 1e-6;
    pid.configure(settings);
    for (int k = 0; k < 5; ++k) u = pid.step(5.0, 4.0, 6.0, 0.0);
    CHECK(u - 6.0 == Approx(0.5 * 1.0 * kPeriod));
  }
}

TEST_CASE("a controller without integral action has no integral for tracking", "[control][pid]") {
  PidSettings settings = pi(1.0, 0.0);
  settings.anti_windup = AntiWindup::back_calculation;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 5.0, 5.0);
  for (int k = 0; k < 100; ++k) pid.step(5.0, -20.0, 10.0, 0.0);
  CHECK(pid.step(5.0, 5.0, 10.0, 0.0) == 5.0);
}

TEST_CASE("conditional integration stops only the integration that would drive further away",
          "[control][pid]") {
  PidSettings settings = pi(1.0, 0.5);
  settings.anti_windup = AntiWindup::conditional;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 5.0, 5.0);
  pid.step(5.0, 4.0, 5.0, 0.0);
  const double held = pid.integral();
  pid.step(5.0, 4.0, 3.0, 0.0);  // less was applied than requested
  CHECK(pid.integral() == held);
  pid.step(5.0, 6.0, 3.0, 0.0);  // the error turned: integration helps
  CHECK(pid.integral() == Approx(held - 0.05));
  pid.step(5.0, 4.0, 9.0, 0.0);  // more was applied than requested: integration upwards helps
  CHECK(pid.integral() == Approx(held));
  CHECK(pid.error(5.0, 4.0) == 1.0);
  const double u = pid.step(5.0, 4.0, 9.0, 0.0);
  const double before = pid.integral();
  pid.step(5.0, 4.0, u - 0.01, 0.0);  // by a small amount
  CHECK(pid.integral() == before);
}

TEST_CASE("a difference within the tolerance is no windup", "[control][pid]") {
  const auto kind = GENERATE(AntiWindup::back_calculation, AntiWindup::conditional);
  PidSettings settings = pi(1.0, 0.5);
  settings.anti_windup = kind;
  settings.tolerance = 0.3;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 5.0, 5.0);
  const double u = pid.step(5.0, 4.0, 5.0, 0.0);
  const double before = pid.integral();
  pid.step(5.0, 4.0, u - 0.29, 0.0);
  CHECK(pid.integral() == Approx(before + 0.05));
}

TEST_CASE("an output that is shifted has not wound up", "[control][pid]") {
  PidSettings settings = pi(2.0, 0.5);
  settings.anti_windup = AntiWindup::back_calculation;
  Pid pid(settings, kPeriod);
  pid.initialise(4.0, 3.0, 3.0);
  CHECK(pid.step(3.0, 3.0, 4.0, 0.0) == 4.0);
  pid.shift(2.0);
  CHECK(pid.step(3.0, 3.0, 6.0, 0.0) == 6.0);
}

TEST_CASE("the derivative acts on PV only", "[control][pid]") {
  PidSettings settings = pi(1.0, 0.0);
  settings.gains.kd = 2.0;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 3.0, 3.0);

  SECTION("a set-point step gives no kick") {
    CHECK(pid.step(4.0, 3.0, 5.0, 0.0) == Approx(6.0));  // proportional only
  }
  SECTION("a PV ramp is opposed: Kd times its slope") {
    CHECK(pid.step(3.0, 3.05, 5.0, 0.0) == Approx(5.0 - 0.05 - 2.0 * 0.5));
    CHECK(pid.step(3.0, 3.05, 5.0, 0.0) == Approx(5.0 - 0.05));
  }
  SECTION("in direct action it pushes the other way") {
    settings.action = Action::direct;
    Pid direct(settings, kPeriod);
    direct.initialise(5.0, 3.0, 3.0);
    CHECK(direct.step(3.0, 3.05, 5.0, 0.0) == Approx(5.0 + 0.05 + 2.0 * 0.5));
  }
}

TEST_CASE("the derivative is filtered with its time constant", "[control][pid]") {
  PidSettings settings = pi(0.0, 0.0);
  settings.gains.kd = 2.0;
  settings.gains.derivative_filter_s = 0.5;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 0.0, 0.0);
  // Ramp of 1 PV unit/s: the filtered derivative approaches -2 as 1 - exp(-t / Tf).
  for (int k = 1; k <= 20; ++k) {
    const double t = k * kPeriod;
    REQUIRE(pid.step(0.0, t, 5.0, 0.0) == Approx(5.0 - 2.0 * (1.0 - std::exp(-t / 0.5))));
  }
}

TEST_CASE("settings changed while running give no bump", "[control][pid]") {
  PidSettings settings = pi(1.0, 0.2);
  settings.gains.kd = 1.5;
  settings.gains.derivative_filter_s = 0.4;
  settings.output_low = -100.0;
  settings.output_high = 100.0;
  Pid pid(settings, kPeriod);
  pid.initialise(5.0, 3.0, 3.0);
  // PV moves steadily, so that every term is active.
  double pv = 3.0;
  constexpr double kSlope = -0.2;  // PV units/s
  double u = 5.0;
  const auto run = [&](int periods) {
    for (int k = 0; k < periods; ++k) u = pid.step(3.0, pv += kSlope * kPeriod, u, 0.0);
  };
  run(30);
  const double before = u;
  const double error = 3.0 - pv;

  SECTION("proportional gain") { settings.gains.kp = 4.0; }
  SECTION("integral gain") { settings.gains.ki = 0.9; }
  SECTION("derivative gain up") { settings.gains.kd = 6.0; }
  SECTION("derivative gain off") { settings.gains.kd = 0.0; }
  SECTION("derivative filter") { settings.gains.derivative_filter_s = 1.0; }
  SECTION("action") { settings.action = Action::direct; }
  SECTION("all at once") {
    settings.gains = {.kp = 0.3, .ki = 0.05, .kd = 3.0, .derivative_filter_s = 0.2};
    settings.action = Action::direct;
  }
  pid.configure(settings);
  run(1);
  // Only one period's movement of the three terms, at the new gains, is allowed.
  const PidGains& gains = settings.gains;
  const double own = (gains.kp * std::abs(kSlope) + gains.ki * (error + 0.02)) * kPeriod +
                     0.02 * gains.kd * std::abs(kSlope);
  CHECK(std::abs(u - before) <= own + 1e-9);
}

TEST_CASE("a controller initialised at an output continues from it", "[control][pid]") {
  Pid pid(pi(3.0, 0.5), kPeriod);
  SECTION("with no error exactly") {
    pid.initialise(7.3, 4.0, 4.0);
    CHECK(pid.step(4.0, 4.0, 7.3, 0.0) == Approx(7.3).epsilon(1e-15));
  }
  SECTION("with an error by one period's integral action") {
    pid.initialise(7.3, 4.0, 2.0);
    CHECK(pid.step(4.0, 2.0, 7.3, 0.0) == Approx(7.3 + 0.5 * 2.0 * kPeriod));
  }
}

}  // namespace pid_test
