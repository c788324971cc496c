// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "model/numeric/random.hpp"
#include "model/diagnosis/group.hpp"
#include "model/diagnosis/nonlinearity.hpp"
#include "model/diagnosis/variability.hpp"
#include "model/diagnosis/survey_window.hpp"

namespace loopwarden::tests::survey_test {
namespace {

using namespace loopwarden::diagnosis;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

std::vector<double> noise(std::size_t count, std::uint64_t seed) {
  numeric::Random random(seed);
  std::vector<double> x(count);
  for (double& v : x) v = random.normal();
  return x;
}

TEST_CASE("variability: zero in white noise, all of a slow swing, as in theory for an AR(1)",
          "[survey]") {
  CHECK(variability(noise(5000, 1), 3) < 0.02);
  std::vector<double> swing(5000);
  for (std::size_t k = 0; k < swing.size(); ++k) swing[k] = std::sin(0.05 * static_cast<double>(k));
  CHECK(variability(swing, 5) > 0.99);
  // y(k) = a y(k-1) + e: the share that is predictable b samples ahead is a^(2b).
  std::vector<double> ar = noise(40000, 2);
  for (std::size_t k = 1; k < ar.size(); ++k) ar[k] += 0.9 * ar[k - 1];
  CHECK(variability(ar, 1) == Approx(0.81).margin(0.02));
  CHECK(variability(ar, 4) == Approx(std::pow(0.9, 8)).margin(0.03));
  // Missing samples only remove rows.
  for (std::size_t k = 0; k < ar.size(); k += 97) ar[k] = kMissing;
  CHECK(variability(ar, 1) == Approx(0.81).margin(0.02));
  CHECK(std::isnan(variability(noise(50, 1), 3)));
  CHECK(std::isnan(variability(std::vector<double>(5000, 1.0), 3)));
}

TEST_CASE("dead time: when changes of PV begin to follow those of CO", "[survey]") {
  const std::vector<double> moves = noise(3000, 5);
  std::vector<double> co(moves.size());
  std::vector<double> pv(moves.size());
  for (std::size_t k = 1; k < co.size(); ++k)
    co[k] = co[k - 1] + (k % 40 == 0 ? 3.0 * moves[k] : 0.0);
  for (std::size_t k = 1; k < pv.size(); ++k) {
    pv[k] = 0.7 * pv[k - 1] + 0.3 * (k > 7 ? co[k - 7] : 0.0) + 0.001 * moves[k];
  }
  CHECK(dead_time_samples(co, pv, 60) >= 6);
  CHECK(dead_time_samples(co, pv, 60) <= 8);
  CHECK(dead_time_samples(co, pv, 1) == 1);
}

TEST_CASE(
    "nonlinearity: a triangle with corners has it, filtered noise and a sine with noise have not",
    "[survey]") {
  const std::vector<double> n = noise(6000, 4);
  std::vector<double> stuck(4000);
  std::vector<double> sine(4000);
  for (std::size_t k = 0; k < stuck.size(); ++k) {
    const double turn = std::fmod(static_cast<double>(k), 50.0) / 50.0;
    stuck[k] = (turn < 0.3 ? 1.0 : turn < 0.5 ? -0.2 : turn < 0.8 ? -1.0 : 0.4) + 0.05 * n[k];
    sine[k] = std::sin(2.0 * std::numbers::pi * static_cast<double>(k) / 50.0) + 0.3 * n[k];
  }
  std::vector<double> filtered(n.size());
  for (std::size_t k = 2; k < n.size(); ++k)
    filtered[k] = 1.93 * filtered[k - 1] - 0.945 * filtered[k - 2] + n[k];
  CHECK(nonlinearity(stuck, 50.0, 1) > 1.0);
  CHECK(nonlinearity(filtered, 50.0, 1) < 1.0);
  CHECK(nonlinearity(stuck, 50.0, 1) > nonlinearity(sine, 50.0, 1));
  CHECK(nonlinearity(stuck, 50.0, 1) == nonlinearity(stuck, 50.0, 1));
  CHECK(nonlinearity(stuck, 3000.0, 1) == 0.0);
}

TEST_CASE("loops with one period make a group, the one whose valve shows it first", "[survey]") {
  const std::vector<Swinging> loops{{0, "A", 100.0, 0.0, 3.0}, {1, "B", 102.0, 0.9, 0.5},
                                    {2, "C", 300.0, 0.0, 9.0}, {3, "D", 99.0, 0.0, 5.0},
                                    {4, "E", 40.0, 0.0, 0.0},  {5, "F", 41.0, 0.0, 0.0}};
  const std::vector<Group> groups = find_groups(loops);
  REQUIRE(groups.size() == 2);
  CHECK(groups[0].loops == std::vector<std::size_t>{1, 3, 0});
  CHECK(groups[0].period_s == Approx(100.0));
  CHECK(groups[1].loops == std::vector<std::size_t>{4, 5});
}

TEST_CASE("a window: share in automatic, at the limit, travel, error and turns", "[survey]") {
  std::vector<double> pv(7200);
  std::vector<double> co(7200);
  std::vector<double> sp(7200, 50.0);
  std::vector<double> automatic(7200, 1.0);
  const std::vector<double> n = noise(7200, 9);
  for (std::size_t k = 0; k < pv.size(); ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / 400.0;
    co[k] = 60.0 + 10.0 * std::sin(angle);
    pv[k] = 50.0 + 5.0 * std::sin(angle - 0.8) + 0.05 * n[k];
  }
  for (std::size_t k = 0; k < 1800; ++k) automatic[k] = 0.0;
  const WindowFindings w =
      judge_window({.period_s = 1.0, .pv = pv, .sp = sp, .co = co, .automatic = automatic});
  CHECK(w.automatic == Approx(0.75));
  CHECK(w.complete == 1.0);
  CHECK(w.saturated == 0.0);
  CHECK(w.error == Approx(5.0 / std::sqrt(2.0)).epsilon(0.02));
  CHECK(w.noise == Approx(0.05).epsilon(0.15));
  // 40 units per cycle, 9 cycles per hour, three quarters of two hours.
  CHECK(w.travel_per_hour == Approx(0.75 * 40.0 * 9.0).epsilon(0.05));
  CHECK(w.reversals_per_hour == Approx(0.75 * 18.0).epsilon(0.1));
  CHECK(w.crossings_per_hour == Approx(18.0).epsilon(0.1));
  const WindowFindings moded = judge_window({.period_s = 1.0, .pv = pv, .co = co});
  CHECK(std::isnan(moded.automatic));
  CHECK(std::isnan(moded.error));
}

TEST_CASE("the window since which a cause has lasted", "[survey]") {
  using diagnosis::Cause;
  const std::vector<Cause> causes{Cause::tuning, Cause::none, Cause::tuning, Cause::tuning};
  CHECK(diagnosis::cause_since(causes, Cause::tuning) == 2U);
  CHECK_FALSE(diagnosis::cause_since(causes, Cause::saturation));
  CHECK(diagnosis::cause_since(std::vector{Cause::tuning, Cause::tuning}, Cause::tuning) == 0U);
}

}  // namespace
}  // namespace loopwarden::tests::survey_test
