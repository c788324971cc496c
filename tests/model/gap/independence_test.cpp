// SPDX-License-Identifier: Apache-2.0
#include "model/gap/independence.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "model/numeric/random.hpp"

namespace independence_test {

using namespace loopwarden;
using namespace loopwarden::gap;

namespace {

constexpr std::size_t kSamples = 2400;
constexpr std::size_t kFrom = 1600;  // of the stretch
constexpr double kPeriod_s = 0.1;
constexpr double kNoise = 0.015;

using Column = std::vector<double>;

// A set point that moves once in 16 s, and a constant one.
Column moving_sp(std::uint64_t seed = 5) {
  numeric::Random random(seed);
  Column sp;
  double at = 5.0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (k % 160 == 0) at = random.uniform(3.0, 7.0);
    sp.push_back(at);
  }
  return sp;
}

// A load of 0.1 % of a span of 10 per root second under white noise.
Column wandering(std::uint64_t seed) {
  numeric::Random random(seed);
  const double keep = std::exp(-kPeriod_s / 300.0);
  double load = 0.0;
  Column out;
  for (std::size_t k = 0; k < kSamples; ++k) {
    load = keep * load + 0.01 * std::sqrt(kPeriod_s) * random.normal();
    out.push_back(load + kNoise * random.normal());
  }
  return out;
}

Column through_lag(const Column& in, double time_constant_s) {
  const double keep = std::exp(-kPeriod_s / time_constant_s);
  double y = in.front();
  Column out;
  for (const double v : in) out.push_back(y = keep * y + (1.0 - keep) * v);
  return out;
}

Independence tested(const Column& error, const Column& sp, const Column& co = {}) {
  double sum = 0.0;
  for (std::size_t k = kFrom; k < kSamples; ++k) sum += error[k] * error[k];
  const double rms2 = sum / static_cast<double>(kSamples - kFrom);
  return test_independence({.error = error,
                            .counts = std::vector<bool>(kSamples, true),
                            .sp = sp,
                            .co = co,
                            .stretch = {kFrom, kSamples},
                            .answer_s = 3.0,
                            .period_s = kPeriod_s,
                            .left_rms = std::sqrt(std::max(0.0, rms2 - kNoise * kNoise)),
                            .nothing_rms = 0.03,
                            .matters_rms = 0.03});
}

}  // namespace

TEST_CASE("a load that wanders by itself follows neither SP nor CO", "[gap][independence]") {
  int follows = 0;
  int made = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Column load = wandering(seed);
    const Column sp = moving_sp(100 + seed);
    // CO compensates the load. Only the part of CO that follows SP may be tested.
    Column co = through_lag(sp, 2.0);
    const Column smooth = through_lag(load, 2.0);
    for (std::size_t k = 0; k < kSamples; ++k) co[k] -= smooth[k];
    const Independence test = tested(load, sp, co);
    made += test.tested ? 1 : 0;
    follows += test.follows() ? 1 : 0;
  }
  CHECK(made >= 45);
  CHECK(follows <= 2);  // 1 % each, if all of them were large enough to matter
}

TEST_CASE("a response to SP is found under a load, with its size", "[gap][independence]") {
  const Column sp = moving_sp();
  Column co = through_lag(sp, 2.0);
  const Column answer = through_lag(co, 2.0);
  Column error = wandering(3);
  double mean = 0.0;
  for (std::size_t k = kFrom; k < kSamples; ++k) mean += answer[k] / (kSamples - kFrom);
  double sum = 0.0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    error[k] += 0.2 * (answer[k] - mean);
    if (k >= kFrom) sum += 0.04 * (answer[k] - mean) * (answer[k] - mean);
  }
  const Independence test = tested(error, sp, co);
  CHECK(test.tested);
  CHECK(test.follows_sp);
  CHECK(test.follows_co);
  CHECK(test.follows_rms == Approx(std::sqrt(sum / (kSamples - kFrom))).epsilon(0.3));
}

TEST_CASE("a response that is equal for moves up and down is found too", "[gap][independence]") {
  const Column sp = moving_sp();
  Column error = wandering(4);
  Column moves(kSamples, 0.0);
  for (std::size_t k = 1; k < kSamples; ++k) moves[k] = std::abs(sp[k] - sp[k - 1]);
  const Column dip = through_lag(through_lag(moves, 1.5), 1.5);
  for (std::size_t k = 0; k < kSamples; ++k) error[k] -= 8.0 * dip[k];
  CHECK(tested(error, sp).follows_sp);
}

TEST_CASE("a response that does not matter is accepted", "[gap][independence]") {
  const Column sp = moving_sp();
  numeric::Random random(6);
  const Column answer = through_lag(sp, 2.0);
  Column error;
  for (const double v : answer) error.push_back(0.02 * (v - 5.0) + 0.001 * random.normal());
  LeftOver left{.error = error,
                .counts = std::vector<bool>(kSamples, true),
                .sp = sp,
                .co = {},
                .stretch = {kFrom, kSamples},
                .answer_s = 3.0,
                .period_s = kPeriod_s,
                .left_rms = 0.08,
                .nothing_rms = 0.002,
                .matters_rms = 0.05};
  CHECK_FALSE(test_independence(left).follows());
  const Independence counts = [&] {
    LeftOver more{left.error, left.counts, left.sp, left.co, left.stretch,
                  3.0,        kPeriod_s,   0.08,    0.002,   0.002};
    return test_independence(more);
  }();
  CHECK(counts.follows_sp);
}

TEST_CASE("without moves of SP the test has no power, and reports this", "[gap][independence]") {
  const Column load = wandering(7);
  const Independence standing = tested(load, Column(kSamples, 5.0));
  CHECK_FALSE(standing.tested);
  CHECK(standing.why_not == "SP is constant there");
  const Independence unknown = tested(load, {});
  CHECK_FALSE(unknown.tested);
  CHECK(unknown.why_not == "SP is not known");
  // Moves only before the tested stretch.
  Column early = moving_sp();
  for (std::size_t k = kFrom; k < kSamples; ++k) early[k] = early[kFrom];
  CHECK_FALSE(tested(load, early).tested);
}

TEST_CASE("one move is enough if the remaining error would be conspicuous", "[gap][independence]") {
  Column sp(kSamples, 4.0);
  for (std::size_t k = 2000; k < kSamples; ++k) sp[k] = 6.0;
  CHECK(tested(wandering(7), sp).tested);
  CHECK_FALSE(tested(wandering(7), sp).follows());
  Column error = wandering(7);
  const Column answer = through_lag(through_lag(sp, 2.0), 2.0);
  for (std::size_t k = 0; k < kSamples; ++k) error[k] += 0.2 * (answer[k] - 5.0);
  CHECK(tested(error, sp).follows_sp);
  // After a move at the very end, no sample is left for a response.
  Column late(kSamples, 4.0);
  late.back() = 4.1;
  const Independence test = tested(wandering(7), late);
  CHECK_FALSE(test.tested);
  CHECK(test.why_not == "SP moves too little there");
}

TEST_CASE("pure noise passes the test, even with a constant SP", "[gap][independence]") {
  numeric::Random random(8);
  Column error;
  for (std::size_t k = 0; k < kSamples; ++k) error.push_back(kNoise * random.normal());
  const Independence test = tested(error, Column(kSamples, 5.0));
  CHECK(test.tested);
  CHECK_FALSE(test.follows());
}

TEST_CASE("samples that don't count have no effect", "[gap][independence]") {
  const Column sp = moving_sp();
  Column error = wandering(9);
  std::vector<bool> counts(kSamples, true);
  for (std::size_t k = 1700; k < 1760; ++k) {
    error[k] = 50.0;
    counts[k] = false;
  }
  const Independence test = test_independence({.error = error,
                                               .counts = counts,
                                               .sp = sp,
                                               .co = {},
                                               .stretch = {kFrom, kSamples},
                                               .answer_s = 3.0,
                                               .period_s = kPeriod_s,
                                               .left_rms = 0.1,
                                               .nothing_rms = 0.03,
                                               .matters_rms = 0.03});
  CHECK_FALSE(test.follows());
}

}  // namespace independence_test
