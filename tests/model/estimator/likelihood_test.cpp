// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/likelihood.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/estimator/estimator_support.hpp"

namespace likelihood_test {

using namespace loopwarden;
using namespace loopwarden::estimator;

namespace {

struct Case {
  plant::LoopModel model = estimator_test::believed_model();
  Observed observed = estimator_test::record_of(model, estimator_test::moving_output(900));
  LoopFacts loop{plant::without_noise(model)};
  LoopRun run{loop, observed.co};
  Slips slips;
  Likelihood likelihood{loop, run, observed, 600, 0.02, slips};
};

}  // namespace

TEST_CASE("the free run is that of the simulated plant", "[estimator][likelihood]") {
  plant::LoopModel truth = estimator_test::believed_model();
  truth.transmitter.noise = 0.0;
  truth.valve_effects = {{"backlash", {{"deadband", 0.5}}}};
  const Observed observed = estimator_test::record_of(truth, estimator_test::moving_output(600));
  LoopFacts loop(truth);
  loop.model.has_valve = false;  // no friction of a healthy valve
  const LoopRun run(loop, observed.co);
  const Hypothesis none(loop, {});
  const std::vector<double> z(none.layout().size, 0.5);
  std::vector<double> columns[3];
  run.run(none, none.at(z), 600, nullptr, columns, nullptr);
  for (std::size_t k = 0; k < 600; k += 37) {
    CHECK(columns[0][k] + run.offset()[k] == Approx(observed.pv[k]).margin(1e-9));
  }
}

TEST_CASE("the derivatives are those of the time constant and the dead time",
          "[estimator][likelihood]") {
  Case c;
  const Hypothesis none(c.loop, {});
  const std::vector<double> z(none.layout().size, 0.5);
  Point point = none.at(z);
  std::vector<double> at[3], moved[3];
  c.run.run(none, point, 600, nullptr, at, nullptr);
  point.time_constant_s *= 1.01;
  c.run.run(none, point, 600, nullptr, moved, nullptr);
  double error = 0.0;
  double size = 0.0;
  for (std::size_t k = 0; k < 600; ++k) {
    error += std::pow(moved[0][k] - at[0][k] - 0.01 * at[Columns::kLag][k], 2.0);
    size += std::pow(moved[0][k] - at[0][k], 2.0);
  }
  CHECK(error < 1e-3 * size);
  point = none.at(z);
  point.dead_time_s += 0.1;
  c.run.run(none, point, 600, nullptr, moved, nullptr);
  for (std::size_t k = 50; k < 600; k += 29) {
    CHECK(moved[0][k] - at[0][k] == Approx(0.1 * at[Columns::kDeadTime][k]).margin(1e-9));
  }
}

TEST_CASE("linear parameters are integrated out exactly", "[estimator][likelihood]") {
  Case c;
  const Hypothesis none(c.loop, {});
  std::vector<double> z(none.layout().size, 0.5);
  Likelihood::Work work;
  const auto of = [&](std::vector<double> place, Solution* solution) {
    return c.likelihood.of(none, place, work, solution);
  };
  Solution solution;
  const double value = of(z, &solution);
  CHECK(value == solution.log_likelihood);
  CHECK(value == of(z, nullptr));
  // The posterior of beta is Gaussian: log L = log p(y | b) + log p(b) - log p(b | y) at any b, so
  // also at the mean, where the first term is known from the innovations.
  const Eigen::Index size = solution.mean.size();
  double log_prior = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) {
    const double deviation = c.likelihood.allowed(static_cast<std::size_t>(i));
    log_prior -= 0.5 * std::pow(solution.mean(i) / deviation, 2.0) + std::log(deviation);
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(solution.covariance);
  double log_posterior = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) log_posterior -= std::log(factor.matrixLLT()(i, i));
  const double log_data = -0.5 * solution.innovations.squaredNorm() - solution.log_scales.sum();
  CHECK(value == Approx(log_data + log_prior - log_posterior).epsilon(1e-6));
  // The true model lies within the uncertainty of the solution.
  CHECK(std::abs(solution.mean(0)) < 4.0 * std::sqrt(solution.covariance(0, 0)));
}

TEST_CASE("a missing sample changes nothing but itself", "[estimator][likelihood]") {
  Case c;
  Observed holes = c.observed;
  for (std::size_t k = 300; k < 340; ++k) {
    holes.used[k] = false;
    holes.pv[k] = 1e6;
  }
  const Likelihood with_holes(c.loop, c.run, holes, 600, 0.02, c.slips);
  const Hypothesis none(c.loop, {});
  std::vector<double> z(none.layout().size, 0.5);
  Likelihood::Work work;
  Solution a, b;
  c.likelihood.of(none, z, work, &a);
  with_holes.of(none, z, work, &b);
  CHECK(b.gain() == Approx(a.gain()).epsilon(0.005));
}

TEST_CASE("another size of the error at the same place gives the bits of a new run",
          "[estimator][likelihood]") {
  Case c;
  const Hypothesis none(c.loop, {});
  std::vector<double> z(none.layout().size, 0.5);
  Likelihood::Work kept;
  c.likelihood.of(none, z, kept);
  z[none.layout().error] = 0.9;
  z[none.layout().error + 1] = 0.1;
  Likelihood::Work fresh;
  CHECK(c.likelihood.of(none, z, kept) == c.likelihood.of(none, z, fresh));
  CHECK(kept.evaluations == 1);
  z[0] = 0.6;
  CHECK(c.likelihood.of(none, z, kept) == c.likelihood.of(none, z, fresh));
  CHECK(kept.evaluations == 2);
}

}  // namespace likelihood_test
