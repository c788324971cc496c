// SPDX-License-Identifier: Apache-2.0
#include "model/gap/load_filter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "model/numeric/random.hpp"

namespace load_filter_test {

using loopwarden::gap::LoadFilter;
using loopwarden::numeric::Random;

namespace {

constexpr double kPeriod = 0.5;  // s

// Load and noise of standard deviation `noise`, as defined in the filter's header.
std::vector<double> wandering(std::size_t samples, double ratio, double noise, std::uint64_t seed) {
  Random random(seed);
  const double keep = std::exp(-kPeriod / LoadFilter::kReturnTime_s);
  const double rms = noise * ratio * std::sqrt(LoadFilter::kReturnTime_s / (2.0 * kPeriod));
  double load = rms * random.normal();
  std::vector<double> series;
  for (std::size_t k = 0; k < samples; ++k) {
    series.push_back(load + noise * random.normal());
    load = keep * load + rms * std::sqrt(1.0 - keep * keep) * random.normal();
  }
  return series;
}

std::vector<double> whitened(const LoadFilter& filter, const std::vector<double>& in) {
  std::vector<double> out(filter.count());
  filter.whiten(in, out);
  return out;
}

// Returns the correlation of values `lag` apart over the mean square.
double correlation(const std::vector<double>& v, std::size_t lag) {
  double product = 0.0;
  double square = 0.0;
  for (std::size_t k = 0; k < v.size(); ++k) {
    square += v[k] * v[k];
    if (k >= lag) product += v[k] * v[k - lag];
  }
  return product / square;
}

double mean_square(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += x * x;
  return sum / static_cast<double>(v.size());
}

// Returns the covariance of the used samples in units of the noise's variance.
Eigen::MatrixXd covariance(const std::vector<bool>& used, double ratio, LoadFilter::Valve valve) {
  std::vector<double> at_s;
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (used[k]) at_s.push_back(kPeriod * static_cast<double>(k));
  }
  const auto n = static_cast<Eigen::Index>(at_s.size());
  Eigen::MatrixXd c = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double apart_s =
          std::abs(at_s[static_cast<std::size_t>(i)] - at_s[static_cast<std::size_t>(j)]);
      c(i, j) += ratio * ratio * LoadFilter::kReturnTime_s / (2.0 * kPeriod) *
                     std::exp(-apart_s / LoadFilter::kReturnTime_s) +
                 valve.ratio * valve.ratio * std::exp(-apart_s / valve.forgets_s);
    }
  }
  return c;
}

}  // namespace

TEST_CASE("a wandering load under noise becomes independent innovations of the noise's variance",
          "[gap][load]") {
  constexpr double kRatio = 0.3;
  constexpr double kNoise = 0.02;
  constexpr std::size_t kSamples = 20'000;
  const std::vector<double> series = wandering(kSamples, kRatio, kNoise, 3);
  const LoadFilter filter(std::vector<bool>(kSamples, true), kPeriod, kRatio);
  CHECK(filter.count() == kSamples);
  CHECK(filter.load_ratio() == kRatio);
  const std::vector<double> e = whitened(filter, series);
  CHECK(correlation(series, 1) > 0.5);  // before
  for (const std::size_t lag : {1U, 2U, 5U, 20U, 100U}) {
    CAPTURE(lag);
    CHECK(correlation(e, lag) == Approx(0.0).margin(4.0 / std::sqrt(kSamples)));
  }
  CHECK(mean_square(e) == Approx(kNoise * kNoise).epsilon(0.04));
}

TEST_CASE("samples that are not used are skipped", "[gap][load]") {
  constexpr double kRatio = 0.5;
  constexpr std::size_t kSamples = 12'000;
  std::vector<double> series = wandering(kSamples, kRatio, 1.0, 5);
  std::vector<bool> used(kSamples, true);
  Random random(8);
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (random.uniform() > 0.3) continue;
    used[k] = false;
    series[k] = 1e9;  // this value must not matter
  }
  const LoadFilter filter(used, kPeriod, kRatio);
  const std::vector<double> e = whitened(filter, series);
  CHECK(e.size() == static_cast<std::size_t>(std::count(used.begin(), used.end(), true)));
  CHECK(mean_square(e) == Approx(1.0).epsilon(0.05));
  CHECK(correlation(e, 1) == Approx(0.0).margin(0.04));
}

TEST_CASE("determinant and squares are those of the dense covariance", "[gap][load]") {
  const std::vector<bool> used =
      GENERATE(std::vector<bool>(6, true),
               std::vector<bool>{false, true, true, false, false, true, true, false, true, true});
  const double ratio = GENERATE(0.05, 0.4, 3.0);
  const LoadFilter::Valve valve =
      GENERATE(LoadFilter::Valve{}, LoadFilter::Valve{0.5, 2.0}, LoadFilter::Valve{4.0, 0.7});
  const LoadFilter filter(used, kPeriod, ratio, valve);
  const Eigen::MatrixXd c = covariance(used, ratio, valve);
  REQUIRE(filter.count() == 6);
  CHECK(filter.log_determinant() == Approx(std::log(c.determinant())).epsilon(1e-9));
  const std::vector<double> series = wandering(used.size(), ratio, 1.0, 17);
  Eigen::VectorXd r(6);
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (used[k]) r(next++) = series[k];
  }
  double squares = 0.0;
  for (const double e : whitened(filter, series)) squares += e * e;
  CHECK(squares == Approx(r.dot(c.ldlt().solve(r))).epsilon(1e-9));
}

TEST_CASE("the error that a valve leaves for seconds does not cost the level", "[gap][load]") {
  // A constant plus a part that forgets itself in 2 s. A load that is large enough to whiten that
  // part hardly distinguishes the constant from a load.
  constexpr std::size_t kSamples = 1000;
  const std::vector<bool> used(kSamples, true);
  const std::vector<double> level(kSamples, 1.0);
  const auto known = [&](const LoadFilter& filter) {
    const std::vector<double> e = whitened(filter, level);
    return std::sqrt(mean_square(e) * kSamples);  // a level of 1 in standard deviations
  };
  const double with_load = known(LoadFilter(used, kPeriod, 1.5));
  const double with_valve = known(LoadFilter(used, kPeriod, 0.0, {1.5, 2.0}));
  CHECK(with_load < 0.1);
  CHECK(with_valve > 5.0);
}

TEST_CASE("without a load the series is unchanged", "[gap][load]") {
  const std::vector<double> series = wandering(50, 0.5, 1.0, 1);
  const LoadFilter filter(std::vector<bool>(50, true), kPeriod, 0.0);
  CHECK(whitened(filter, series) == series);
  CHECK(filter.log_determinant() == 0.0);
}

TEST_CASE("several columns at once give the same bits as one by one", "[gap][load]") {
  std::vector<bool> used(300, true);
  for (std::size_t k = 40; k < 60; ++k) used[k] = false;
  const LoadFilter filter(used, kPeriod, 0.2,
                          GENERATE(LoadFilter::Valve{}, LoadFilter::Valve{0.5, 2.0}));
  for (std::size_t count = 1; count <= 9; ++count) {
    std::vector<std::vector<double>> in;
    for (std::size_t c = 0; c < count; ++c) in.push_back(wandering(300, 0.2, 1.0, c + 1));
    std::vector<std::vector<double>> out;
    filter.whiten(in, out);
    REQUIRE(out.size() == count);
    for (std::size_t c = 0; c < count; ++c) CHECK(out[c] == whitened(filter, in[c]));
  }
}

}  // namespace load_filter_test
