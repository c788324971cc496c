// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/archive.hpp"

#include <array>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "model/numeric/random.hpp"
#include "tests/support/archive.hpp"

namespace loopwarden::tests::archive_test {
namespace {

using namespace loopwarden::analysis;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// A flow signal: slow wander, a swing, noise.
std::vector<double> flow(std::size_t count, double noise, std::uint64_t seed = 3) {
  numeric::Random random(seed);
  std::vector<double> x(count);
  double wander = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    wander += 0.03 * random.normal();
    x[k] = 50.0 + wander + 4.0 * std::sin(0.05 * static_cast<double>(k)) + noise * random.normal();
  }
  return x;
}

TEST_CASE("a plain signal is no archive, with or without noise, coarse, held or clipped",
          "[archive]") {
  CHECK(recognise_filled(with_decimals(flow(4000, 0.1), 3)).kind == ArchiveKind::none);
  CHECK(recognise_filled(with_decimals(flow(4000, 0.0), 4)).kind == ArchiveKind::none);
  CHECK(recognise_filled(flow(4000, 0.0)).kind == ArchiveKind::none);
  CHECK(recognise_filled(with_decimals(flow(4000, 0.3), 0)).kind == ArchiveKind::none);
  std::vector<double> coarse = flow(4000, 0.02);
  for (double& v : coarse) v = 0.25 * std::nearbyint(v / 0.25);
  CHECK(recognise_filled(coarse).kind == ArchiveKind::none);
  std::vector<double> analyser = flow(4000, 0.1);
  for (std::size_t k = 0; k < analyser.size(); ++k) analyser[k] = analyser[k - k % 10];
  CHECK(recognise_filled(with_decimals(analyser, 3)).kind == ArchiveKind::none);
  // Some renewals repeat the value.
  for (std::size_t k = 100; k + 10 < analyser.size(); k += 200) {
    for (std::size_t i = k; i < k + 10; ++i) analyser[i] = analyser[k - 1];
  }
  CHECK(recognise_filled(with_decimals(analyser, 3)).kind == ArchiveKind::none);
  CHECK(recognise_filled(std::vector<double>(4000, 3.0)).kind == ArchiveKind::none);
  std::vector<double> gaps = flow(4000, 0.1);
  for (std::size_t k = 0; k < gaps.size(); k += 40) gaps[k] = kMissing;
  CHECK(recognise_filled(with_decimals(gaps, 3)).kind == ArchiveKind::none);
}

TEST_CASE("converter steps, integers and a manually stepped output are no archive", "[archive]") {
  // A converter of 10 bits, written with two decimals: steps of 0.03 and 0.04.
  for (const double step : {0.0322, 0.0977, 0.3223, 0.1}) {
    for (const double noise : {0.01, 0.03, 0.1}) {
      for (const std::uint64_t seed : {3UL, 4UL, 5UL}) {
        std::vector<double> x = flow(3000, noise, seed);
        for (double& v : x) v = step * std::nearbyint((50.0 + 0.1 * (v - 50.0)) / step);
        INFO(step << " " << noise << " " << seed);
        CHECK(recognise_filled(with_decimals(x, 2)).kind == ArchiveKind::none);
        CHECK(recognise_filled(x).kind == ArchiveKind::none);
      }
    }
  }
  for (const std::uint64_t seed : {3UL, 4UL, 5UL})
    CHECK(recognise_filled(with_decimals(flow(3000, 0.05, seed), 0)).kind == ArchiveKind::none);
  // Manual steps between a few values.
  for (const double round : {5.0, 2.5}) {
    for (const std::uint64_t seed : {3UL, 4UL, 5UL, 6UL}) {
      numeric::Random random(seed);
      std::vector<double> co;
      double at = 40.0;
      while (co.size() < 3000) {
        const auto hold = static_cast<std::size_t>(random.uniform(20.0, 90.0));
        co.insert(co.end(), hold, at);
        const double move = random.uniform(2.0, 12.0) * (random.uniform() < 0.5 ? -1.0 : 1.0);
        at = round * std::nearbyint(std::clamp(at + move, 10.0, 90.0) / round);
      }
      INFO(round << " " << seed);
      CHECK(recognise_filled(co).kind == ArchiveKind::none);
    }
  }
}

TEST_CASE("a signal without noise that settles between steps of CO is no archive", "[archive]") {
  for (const int decimals : {2, 3, 4}) {
    for (const double lag : {2.0, 5.0, 12.0}) {
      std::vector<double> pv;
      double at = 22.0;
      for (std::size_t k = 0; k < 3200; ++k) {
        const double co = std::array{20.0, 30.0, 40.0, 50.0, 60.0, 50.0, 40.0, 30.0}[k / 200 % 8];
        at += (0.6 * co + 10.0 - at) / lag;
        pv.push_back(at);
      }
      INFO(decimals << " " << lag);
      CHECK(recognise_filled(with_decimals(pv, decimals)).kind == ArchiveKind::none);
    }
  }
}

TEST_CASE("exception reporting of integers and of one decimal is still seen", "[archive]") {
  for (const auto& [decimals, band] : {std::pair{0, 4.0}, {1, 0.6}, {2, 0.4}}) {
    std::vector<double> x = flow(6000, 0.1);
    for (double& v : x) v = 50.0 + (decimals == 0 ? 10.0 : 1.0) * (v - 50.0);
    x = with_decimals(x, decimals);
    INFO(decimals);
    CHECK(recognise_filled(held_between(x, by_exception(x, band))).kind == ArchiveKind::exception);
  }
}

TEST_CASE("exception reporting that was filled by the last value: kind and dead band",
          "[archive]") {
  for (const double band : {0.4, 1.0, 2.0}) {
    const std::vector<double> x = with_decimals(flow(4000, 0.1), 3);
    const ArchivedSignal found = recognise_filled(held_between(x, by_exception(x, band)));
    INFO(band);
    CHECK(found.kind == ArchiveKind::exception);
    CHECK(found.deviation == Approx(band).epsilon(0.1));
    CHECK(found.stored_share < 0.5);
  }
}

TEST_CASE(
    "a swinging door that was filled by straight lines: kind, and a deviation within a factor",
    "[archive]") {
  for (const double deviation : {0.2, 0.5, 1.0}) {
    const std::vector<double> x = with_decimals(flow(6000, 0.1), 3);
    const ArchivedSignal found =
        recognise_filled(with_decimals(lines_between(x, by_swinging_door(x, deviation)), 4));
    INFO(deviation);
    CHECK(found.kind == ArchiveKind::swinging_door);
    CHECK_FALSE(found.held_lines);
    CHECK(found.deviation > deviation / 3.0);
    CHECK(found.deviation < deviation * 3.0);
  }
}

TEST_CASE("a swinging door that was filled by the last value is known for that, and drawn again",
          "[archive]") {
  const std::vector<double> x = with_decimals(flow(6000, 0.1), 3);
  const Places stored = by_swinging_door(x, 0.5);
  const std::vector<double> held = held_between(x, stored);
  const ArchivedSignal found = recognise_filled(held);
  CHECK(found.kind == ArchiveKind::swinging_door);
  CHECK(found.held_lines);
  const std::vector<double> again = lines_for_steps(held);
  const std::vector<double> lines = lines_between(x, stored);
  // If the next stored value is the same, holding it makes no visible difference.
  std::size_t other = 0;
  for (std::size_t k = 0; k < x.size(); ++k)
    other += std::abs(again[k] - lines[k]) > 1e-9 ? 1U : 0U;
  CHECK(other < x.size() / 20);
}

TEST_CASE("only the stored values, at their own times", "[archive]") {
  const std::vector<double> x = flow(4000, 0.1);
  const auto stored = [&](const Places& places) {
    std::vector<double> times;
    std::vector<double> values;
    for (const std::size_t k : places) {
      times.push_back(2.0 * static_cast<double>(k));
      values.push_back(x[k]);
    }
    return recognise_stored(times, values, 2.0);
  };
  const ArchivedSignal exception = stored(by_exception(x, 1.0));
  CHECK(exception.kind == ArchiveKind::exception);
  CHECK(exception.deviation == Approx(1.0).epsilon(0.1));
  CHECK(stored(by_swinging_door(x, 0.5)).kind == ArchiveKind::swinging_door);
  Places all(x.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  CHECK(stored(all).kind == ArchiveKind::none);
}

TEST_CASE("the same in a record whose other cells are empty", "[archive]") {
  const std::vector<double> x = flow(4000, 0.1);
  std::vector<double> sparse(x.size(), kMissing);
  for (const std::size_t k : by_exception(x, 1.0)) sparse[k] = x[k];
  CHECK(recognise_filled(sparse).kind == ArchiveKind::exception);
  // A record with one sample in five has another period, and one with a long outage has an outage.
  // Neither is an archive.
  std::vector<double> fifth(x.size(), kMissing);
  for (std::size_t k = 0; k < x.size(); k += 5) fifth[k] = x[k];
  CHECK(recognise_filled(fifth).kind == ArchiveKind::none);
  std::vector<double> outage = x;
  for (std::size_t k = 1000; k < 2500; ++k) outage[k] = kMissing;
  CHECK(recognise_filled(outage).kind == ArchiveKind::none);
}

TEST_CASE("held values are drawn on their way to the next, never outside the dead band",
          "[archive]") {
  const std::vector<double> held{1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 9.0, kMissing, 3.0, 3.0, 2.5};
  const std::vector<double> drawn = within_band(held, 1.0);
  CHECK(drawn[0] == 1.0);
  CHECK(drawn[2] == Approx(1.5));
  CHECK(drawn[3] == Approx(1.75));
  CHECK(drawn[5] == Approx(3.0));  // 5.5 on the straight line
  CHECK(drawn[6] == 9.0);
  CHECK(std::isnan(drawn[7]));
  CHECK(drawn[9] == Approx(2.75));
}

}  // namespace
}  // namespace loopwarden::tests::archive_test
