// SPDX-License-Identifier: Apache-2.0
// Problems with known answers: Hock and Schittkowski, Test Examples for Nonlinear Programming Codes
// (Springer 1981), those with bounds alone that are sums of squares; NIST's Misra1a.
#include "model/numeric/least_squares.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace least_squares_test {

using namespace loopwarden::numeric;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void rosenbrock(const std::vector<double>& x, Eigen::VectorXd& r) {
  r.resize(2);
  r << 10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0];
}

}  // namespace

TEST_CASE("Rosenbrock's valley to its end (Hock-Schittkowski 1)", "[numeric]") {
  const LeastSquares found =
      least_squares({{.value = -2.0}, {.value = 1.0, .low = -1.5}}, rosenbrock);
  CHECK(found.x[0] == Approx(1.0).epsilon(1e-6));
  CHECK(found.x[1] == Approx(1.0).epsilon(1e-6));
  CHECK(found.sum_squares < 1e-12);
  CHECK(found.sum_squares == found.residual.squaredNorm());
}

TEST_CASE("Rosenbrock's valley cut off by a bound (Hock-Schittkowski 2)", "[numeric]") {
  // Starts from the right-hand side. The other valley has a worse answer.
  const LeastSquares found =
      least_squares({{.value = 2.0}, {.value = 2.0, .low = 1.5}}, rosenbrock);
  CHECK(found.x[0] == Approx(1.224370749).epsilon(1e-6));
  CHECK(found.x[1] == 1.5);
  CHECK(found.sum_squares == Approx(0.0504261879).epsilon(1e-8));
}

TEST_CASE("an upper bound in the valley", "[numeric]") {
  const LeastSquares found =
      least_squares({{.value = -1.2, .high = 0.5}, {.value = 1.0}}, rosenbrock);
  CHECK(found.x[0] == 0.5);
  CHECK(found.x[1] == Approx(0.25).epsilon(1e-6));
  CHECK(found.sum_squares == Approx(0.25));
}

TEST_CASE("a start outside its bounds is cut to them", "[numeric]") {
  const LeastSquares found = least_squares(
      {{.value = 9.0, .low = -1.0, .high = 0.5}, {.value = -7.0, .low = 0.1, .high = 2.0}},
      rosenbrock);
  CHECK(found.x[0] == Approx(0.5));
  CHECK(found.x[1] == Approx(0.25).epsilon(1e-6));
}

TEST_CASE("three exponents in bounds (Hock-Schittkowski 25)", "[numeric]") {
  const auto weibull = [](const std::vector<double>& x, Eigen::VectorXd& r) {
    r.resize(99);
    for (int i = 0; i < 99; ++i) {
      const double at = 0.01 * (i + 1);
      const double u = 25.0 + std::pow(-50.0 * std::log(at), 2.0 / 3.0);
      r(i) = std::exp(-std::pow(u - x[1], x[2]) / x[0]) - at;
    }
  };
  // From a start nearer than the textbook's, where the slopes underflow.
  const LeastSquares found = least_squares({{.value = 60.0, .low = 0.1, .high = 100.0},
                                            {.value = 20.0, .low = 0.0, .high = 25.6},
                                            {.value = 1.6, .low = 0.0, .high = 5.0}},
                                           weibull);
  CHECK(found.x[0] == Approx(50.0).epsilon(1e-3));
  CHECK(found.x[1] == Approx(25.0).epsilon(1e-3));
  CHECK(found.x[2] == Approx(1.5).epsilon(1e-3));
}

TEST_CASE("Colville's function (Hock-Schittkowski 38)", "[numeric]") {
  const auto wood = [](const std::vector<double>& x, Eigen::VectorXd& r) {
    r.resize(6);
    r << 10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0], std::sqrt(90.0) * (x[3] - x[2] * x[2]),
        1.0 - x[2], std::sqrt(10.0) * (x[1] + x[3] - 2.0), std::sqrt(0.1) * (x[1] - x[3]);
  };
  const auto within = [](double value) {
    return Parameter{.value = value, .low = -10.0, .high = 10.0};
  };
  const LeastSquares found =
      least_squares({within(-3.0), within(-1.0), within(-3.0), within(-1.0)}, wood);
  for (const double x : found.x) CHECK(x == Approx(1.0).epsilon(1e-5));
}

TEST_CASE("a measured curve (NIST Misra1a), to its certified digits", "[numeric]") {
  constexpr std::array kX{77.6,  114.9, 141.1, 190.8, 239.9, 289.0, 332.8,
                          378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0};
  constexpr std::array kY{10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02,
                          44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78};
  const auto misra = [&](const std::vector<double>& b, Eigen::VectorXd& r) {
    r.resize(14);
    for (std::size_t i = 0; i < kX.size(); ++i) {
      r(static_cast<Eigen::Index>(i)) = kY[i] - b[0] * (1.0 - std::exp(-b[1] * kX[i]));
    }
  };
  const LeastSquares found = least_squares(
      {{.value = 500.0, .relative_difference = 1e-7}, {.value = 1e-4, .difference = 1e-11}}, misra);
  CHECK(found.x[0] == Approx(2.3894212918e2).epsilon(1e-6));
  CHECK(found.x[1] == Approx(5.5015643181e-4).epsilon(1e-6));
  CHECK(found.sum_squares == Approx(1.2455138894e-1).epsilon(1e-9));
}

TEST_CASE("no residual is evaluated outside the bounds", "[numeric]") {
  bool outside = false;
  const auto watched = [&](const std::vector<double>& x, Eigen::VectorXd& r) {
    outside = outside || x[0] > 0.5 || x[1] < 1.5;
    rosenbrock(x, r);
  };
  least_squares({{.value = 0.5, .high = 0.5}, {.value = 3.0, .low = 1.5}}, watched);
  CHECK_FALSE(outside);
}

TEST_CASE("a place that can't be judged is not moved to", "[numeric]") {
  const auto walled = [](const std::vector<double>& x, Eigen::VectorXd& r) {
    r.resize(1);
    r(0) = x[0] > 2.0 ? std::nan("") : 10.0 - x[0];
  };
  const LeastSquares found = least_squares({{.value = 1.0}}, walled);
  CHECK(found.x[0] > 1.5);
  CHECK(found.x[0] <= 2.0);
  const LeastSquares stays = least_squares({{.value = 3.0}}, walled);
  CHECK(stays.x[0] == 3.0);
}

TEST_CASE("a parameter without influence keeps its value", "[numeric]") {
  const auto blind = [](const std::vector<double>& x, Eigen::VectorXd& r) {
    r.resize(2);
    r << x[0] - 3.0, 0.5;
  };
  const LeastSquares found = least_squares({{.value = 1.0}, {.value = 7.0}}, blind);
  CHECK(found.x[0] == Approx(3.0));
  CHECK(found.x[1] == 7.0);
}

TEST_CASE("a step is no longer than allowed", "[numeric]") {
  const auto line = [](const std::vector<double>& x, Eigen::VectorXd& r) {
    r.resize(1);
    r(0) = x[0] - 10.0;
  };
  const LeastSquares found =
      least_squares({{.value = 0.0, .largest_move = 0.5}}, line, {.most_steps = 3});
  CHECK(found.x[0] == Approx(1.5));
}

TEST_CASE("slopes by differences, away from a bound", "[numeric]") {
  Eigen::VectorXd r;
  const std::vector<double> x{0.5, 2.0};
  rosenbrock(x, r);
  const Eigen::MatrixXd slopes =
      jacobian({{.high = 0.5, .difference = 1e-7}, {.high = kInfinity, .difference = 1e-7}},
               rosenbrock, x, r);
  CHECK(slopes(0, 0) == Approx(-10.0).epsilon(1e-5));
  CHECK(slopes(0, 1) == Approx(10.0).epsilon(1e-5));
  CHECK(slopes(1, 0) == Approx(-1.0).epsilon(1e-5));
  CHECK(slopes(1, 1) == Approx(0.0).margin(1e-9));
}

}  // namespace least_squares_test
