// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/error_filter.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/numeric/random.hpp"

namespace error_filter_test {

using namespace loopwarden::estimator;

namespace {

constexpr double kNoise = 0.1;

Observed observed_with_hole() {
  Observed observed{0.5, std::vector<double>(40, 0.0), std::vector<double>(40, 0.0),
                    std::vector<bool>(40, true)};
  for (int k = 12; k < 17; ++k) observed.used[static_cast<std::size_t>(k)] = false;
  return observed;
}

// Covariance of the used blocks, from the definition in the header.
Eigen::MatrixXd covariance(const Blocks& blocks, ErrorTimes times, double q,
                           const std::vector<double>& law) {
  const auto n = static_cast<Eigen::Index>(blocks.count());
  const double h = blocks.period_s();
  const double a = std::exp(-h / times.returns_s);
  const double f = std::exp(-h / times.answer_s);
  Eigen::MatrixXd all(n, n);
  std::vector<double> d{0.0}, m{law[0]};
  for (Eigen::Index k = 1; k < n; ++k) {
    d.push_back(a * a * d.back() + q * q * h);
    m.push_back(f * f * m.back() + law[static_cast<std::size_t>(k)] * (1.0 - f * f));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const auto at = static_cast<std::size_t>(j);
      const auto apart = static_cast<double>(i - j);
      all(i, j) = all(j, i) = std::pow(a, apart) * d[at] + std::pow(f, apart) * m[at];
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) all(i, i) += blocks.variance()[static_cast<std::size_t>(i)];
  return all;
}

}  // namespace

TEST_CASE("innovations have the likelihood of the whole covariance", "[estimator][filter]") {
  const Observed observed = observed_with_hole();
  const Blocks blocks(observed, 40, 2, kNoise);
  const ErrorTimes times{30.0, 3.0};
  std::vector<double> law(blocks.count());
  for (std::size_t k = 0; k < law.size(); ++k)
    law[k] = 0.01 * (1.0 + 0.5 * std::sin(0.7 * static_cast<double>(k)));
  const ErrorFilter filter(blocks, times, 0.05, law);

  loopwarden::numeric::Random random(2);
  std::vector<double> in(blocks.count());
  for (double& v : in) v = random.normal();
  std::vector<double> out(in.size());
  filter.whiten(in, out);
  double square = 0.0;
  for (const double v : out) square += v * v;

  std::vector<Eigen::Index> used;
  for (std::size_t k = 0; k < blocks.count(); ++k) {
    if (blocks.variance()[k] > 0.0) used.push_back(static_cast<Eigen::Index>(k));
  }
  REQUIRE(used.size() < blocks.count());
  const Eigen::MatrixXd s = covariance(blocks, times, 0.05, law)(used, used);
  const Eigen::VectorXd y =
      Eigen::Map<const Eigen::VectorXd>(in.data(), static_cast<Eigen::Index>(in.size()))(used);
  const Eigen::LLT<Eigen::MatrixXd> factor(s);
  double log_det = 0.0;
  for (Eigen::Index i = 0; i < s.rows(); ++i) log_det += 2.0 * std::log(factor.matrixLLT()(i, i));
  CHECK(square == Approx(y.dot(factor.solve(y))).epsilon(1e-9));
  CHECK(filter.log_determinant() == Approx(log_det).epsilon(1e-9));
  CHECK(filter.log_scales().sum() == Approx(0.5 * log_det).epsilon(1e-9));
}

TEST_CASE("four columns at a time have the bits of one", "[estimator][filter]") {
  const Observed observed = observed_with_hole();
  const Blocks blocks(observed, 40, 2, kNoise);
  const std::vector<double> law(blocks.count(), 0.02);
  const ErrorFilter filter(blocks, {30.0, 3.0}, 0.02, law);
  loopwarden::numeric::Random random(4);
  std::vector<std::vector<double>> in(4, std::vector<double>(blocks.count()));
  auto out = in;
  for (auto& column : in) {
    for (double& v : column) v = random.normal();
  }
  const double* const from[4] = {in[0].data(), in[1].data(), in[2].data(), in[3].data()};
  double* const to[4] = {out[0].data(), out[1].data(), out[2].data(), out[3].data()};
  filter.whiten_four(from, to);
  for (std::size_t i = 0; i < 4; ++i) {
    std::vector<double> one(blocks.count());
    filter.whiten(in[i], one);
    CHECK(one == out[i]);
  }
}

}  // namespace error_filter_test
