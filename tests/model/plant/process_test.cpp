// SPDX-License-Identifier: Apache-2.0
#include "model/plant/process.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

namespace process_test {

using namespace loopwarden;
using namespace loopwarden::plant;

namespace {
constexpr double kPeriod = 0.1;  // s
}

TEST_CASE("a step is answered after the dead time by 1 - exp(-t / T)", "[plant][process]") {
  const double dead_time = GENERATE(0.0, 0.04, 0.1, 0.3, 0.7, 2.6256);
  CAPTURE(dead_time);
  constexpr double kGain = 1.2264;
  constexpr double kTime = 1.69376;  // s
  Process process({.gain = kGain, .time_constant_s = kTime, .dead_time_s = dead_time}, kPeriod);
  process.reset(2.0);
  for (int k = 0; k < 100; ++k) {
    const double t = (k + 1) * kPeriod - dead_time;  // since the step arrived
    const double rise = t > 0.0 ? 1.0 - std::exp(-t / kTime) : 0.0;
    REQUIRE(process.step(5.0) == Approx(kGain * (2.0 + 3.0 * rise)));
  }
}

TEST_CASE("any input is answered as by a fine integration", "[plant][process]") {
  constexpr ProcessParameters kParameters{
      .gain = 0.8, .time_constant_s = 0.9, .dead_time_s = 0.437};
  Process process(kParameters, kPeriod);
  constexpr int kFine = 1000;   // steps a period
  constexpr int kDelay = 4370;  // steps of dead time
  std::vector<double> held(kDelay, 3.0);
  double q = process.reset(3.0);
  CHECK(q == Approx(2.4));
  for (int k = 0; k < 150; ++k) {
    const double u = 3.0 + std::sin(0.3 * k) + (k % 11 < 5 ? 1.0 : -1.0);
    for (int i = 0; i < kFine; ++i) {
      held.push_back(u);
      const double delayed = held[held.size() - 1 - kDelay];
      q += (kParameters.gain * delayed - q) * kPeriod / kFine / kParameters.time_constant_s;
    }
    REQUIRE(process.step(u) == Approx(q).margin(2e-4));
  }
}

TEST_CASE("integrating processes and second lags answer as by a fine integration",
          "[plant][process]") {
  const ProcessParameters p = GENERATE(
      ProcessParameters{.gain = 0.8,
                        .time_constant_s = 0.9,
                        .dead_time_s = 0.437,
                        .second_time_constant_s = 0.35},
      ProcessParameters{
          .gain = 0.8, .time_constant_s = 0.9, .dead_time_s = 0.437, .second_time_constant_s = 0.9},
      ProcessParameters{.gain = -0.3, .dead_time_s = 0.437, .kind = ProcessKind::integrating},
      ProcessParameters{.gain = 0.3,
                        .dead_time_s = 0.437,
                        .second_time_constant_s = 0.6,
                        .kind = ProcessKind::integrating});
  CAPTURE(to_text(p.kind), p.second_time_constant_s);
  Process process(p, kPeriod);
  constexpr int kFine = 1000;   // steps a period
  constexpr int kDelay = 4370;  // steps of dead time
  constexpr double kStart = 3.0;
  std::vector<double> held(kDelay, kStart);
  constexpr double kLevel = 7.0;
  double first = p.integrating() ? 0.0 : p.gain * kStart;
  double q = first;
  REQUIRE(process.reset(kStart, kLevel) == Approx(q + kLevel));
  for (int k = 0; k < 150; ++k) {
    const double u = kStart + std::sin(0.3 * k) + (k % 11 < 5 ? 1.0 : -1.0);
    for (int i = 0; i < kFine; ++i) {
      held.push_back(u);
      const double delayed = held[held.size() - 1 - kDelay];
      const double rate = p.integrating() ? p.gain * (delayed - kStart)
                                          : (p.gain * delayed - first) / p.time_constant_s;
      first += rate * kPeriod / kFine;
      if (p.second_time_constant_s > 0.0) {
        q += (first - q) * kPeriod / kFine / p.second_time_constant_s;
      } else {
        q = first;
      }
    }
    REQUIRE(process.step(u) == Approx(q + kLevel).margin(5e-4));
  }
}

TEST_CASE("an integrating process rests at any input, and at any level", "[plant][process]") {
  Process process({.gain = 0.2, .dead_time_s = 0.25, .kind = ProcessKind::integrating}, kPeriod);
  CHECK(process.reset(4.0, 55.0) == 55.0);
  for (int k = 0; k < 50; ++k) REQUIRE(process.step(4.0) == 55.0);
  // From the dead time on, PV moves at gain times the imbalance of CO.
  for (int k = 0; k < 50; ++k) process.step(5.0);
  CHECK(process.step(5.0) == Approx(55.0 + 0.2 * (51 * kPeriod - 0.25)));
}

TEST_CASE("a process at rest stays so", "[plant][process]") {
  Process process({.gain = 1.7, .time_constant_s = 3.0, .dead_time_s = 1.23}, kPeriod);
  CHECK(process.reset(4.0) == Approx(6.8));
  for (int k = 0; k < 50; ++k) REQUIRE(process.step(4.0) == Approx(6.8).epsilon(1e-14));
}

}  // namespace process_test
