// SPDX-License-Identifier: Apache-2.0
#include "model/gap/reading.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "model/numeric/random.hpp"

namespace reading_test {

using namespace loopwarden;
using gap::examine_reading;
using gap::ReadingFinding;

constexpr double kStep = 0.0025;  // PV units, of a 12-bit converter

// Slow moves with noise, rounded as by a converter.
std::vector<double> noisy(std::size_t samples, double noise = 0.02) {
  numeric::Random random(5);
  std::vector<double> pv;
  for (std::size_t k = 0; k < samples; ++k) {
    const double v = 5.0 + 2.0 * std::sin(0.01 * static_cast<double>(k)) + noise * random.normal();
    pv.push_back(kStep * std::round(v / kStep));
  }
  return pv;
}

std::vector<double> held(std::vector<double> pv, double interval, double first) {
  double last = pv[0];
  double beat = std::floor(-first / interval + 1e-9);
  for (std::size_t k = 1; k < pv.size(); ++k) {
    const double now = std::floor((static_cast<double>(k) - first) / interval + 1e-9);
    if (now != beat) last = pv[k];
    beat = now;
    pv[k] = last;
  }
  return pv;
}

TEST_CASE("a held reading is recognised by its beat, and counts once for each renewal",
          "[gap][reading]") {
  const std::vector<double> pv = held(noisy(2000), 14.0, 5.0);
  const ReadingFinding found = examine_reading(pv);
  REQUIRE(found.held);
  CHECK(found.held->interval_samples == 14.0);
  CHECK(found.held->first_sample == 5.0);
  CHECK_FALSE(found.high);
  CHECK_FALSE(found.low);
  for (std::size_t k = 1; k < pv.size(); ++k) REQUIRE(found.measured[k] == ((k + 9) % 14 == 0));
}

TEST_CASE("a beat that is no whole number of samples is found", "[gap][reading]") {
  const std::vector<double> pv = held(noisy(2000), 7.3, 0.0);
  const ReadingFinding found = examine_reading(pv);
  REQUIRE(found.held);
  CHECK(found.held->interval_samples == Approx(7.3).epsilon(0.001));
  for (std::size_t k = 1; k < pv.size(); ++k) {
    if (pv[k] != pv[k - 1]) {
      // Within a sample of the change.
      REQUIRE((found.measured[k] || found.measured[k - 1] ||
               (k + 1 < pv.size() && found.measured[k + 1])));
    }
  }
}

TEST_CASE("noise, rounding and a historian's compression are no beat", "[gap][reading]") {
  CHECK_FALSE(examine_reading(noisy(2000)).held);
  // A ramp without noise changes by one step at a time, with equal pauses.
  std::vector<double> ramp(2000);
  for (std::size_t k = 0; k < ramp.size(); ++k) {
    ramp[k] = kStep * std::floor(static_cast<double>(k) / 10.0);
  }
  CHECK_FALSE(examine_reading(ramp).held);
  // Reporting by exception: flat as long as PV stays within a band.
  std::vector<double> compressed = noisy(4000, 0.005);
  for (std::size_t k = 1; k < compressed.size(); ++k) {
    if (std::abs(compressed[k] - compressed[k - 1]) < 0.05) compressed[k] = compressed[k - 1];
  }
  CHECK_FALSE(examine_reading(compressed).held);
}

TEST_CASE("a limit of the reading is recognised if PV returns to it and stays", "[gap][reading]") {
  std::vector<double> pv = noisy(2000);
  for (double& v : pv) v = std::clamp(v, 3.5, 6.5);
  const ReadingFinding found = examine_reading(pv);
  REQUIRE(found.high);
  REQUIRE(found.low);
  CHECK(*found.high == 6.5);
  CHECK(*found.low == 3.5);
  CHECK(found.at_high == static_cast<std::size_t>(std::count(pv.begin(), pv.end(), 6.5)));
  for (std::size_t k = 0; k < pv.size(); ++k) {
    REQUIRE(found.measured[k] == (pv[k] > 3.5 && pv[k] < 6.5));
  }
  CHECK_FALSE(examine_reading(noisy(2000)).high);
}

TEST_CASE("one frozen stretch and a quiet record have no end", "[gap][reading]") {
  std::vector<double> frozen = noisy(2000);
  const auto top = std::max_element(frozen.begin(), frozen.end());
  for (auto it = top; it < top + 60; ++it) *it = *top;
  CHECK_FALSE(examine_reading(frozen).high);
  // A pause at one value of a coarse converter is no limit.
  std::vector<double> quiet(2000);
  for (std::size_t k = 0; k < quiet.size(); ++k) quiet[k] = k / 100 % 2 == 0 ? 5.0 : 6.0;
  CHECK_FALSE(examine_reading(quiet).high);
}

TEST_CASE("missing samples and empty records are skipped", "[gap][reading]") {
  std::vector<double> pv = held(noisy(2000), 14.0, 0.0);
  for (std::size_t k = 300; k < 340; ++k) pv[k] = std::numeric_limits<double>::quiet_NaN();
  CHECK(examine_reading(pv).held);
  CHECK(examine_reading({}).measured.empty());
  CHECK_FALSE(examine_reading({1.0, 1.0}).held);
}

TEST_CASE("a spike jumps away and back, within the time it is given", "[gap][reading]") {
  std::vector<double> pv(200, 5.0);
  for (std::size_t k = 0; k < pv.size(); ++k) pv[k] += k % 2 == 0 ? 0.01 : -0.01;
  CHECK(gap::find_spikes(pv, 0.1, 5).count == 0);
  pv[20] += 1.0;
  for (std::size_t k = 50; k < 55; ++k) pv[k] -= 2.0;
  pv[80] = std::numeric_limits<double>::quiet_NaN();  // a missing sample is no spike
  const gap::Spikes found = gap::find_spikes(pv, 0.1, 5);
  CHECK(found.count == 2);
  CHECK(found.samples == 6);
  CHECK(found.at[20]);
  CHECK_FALSE(found.at[21]);
  CHECK(found.at[54]);
  CHECK_FALSE(found.at[55]);
  CHECK(found.size == Approx(2.0).epsilon(0.02));
  CHECK(gap::find_spikes(pv, 0.1, 4).count == 1);
  CHECK(gap::find_spikes(pv, 1.5, 5).count == 1);
  CHECK(gap::find_spikes(pv, 0.1, 0).count == 0);
}

TEST_CASE("a step, a ramp back and a drop to another level are no spikes", "[gap][reading]") {
  std::vector<double> pv(200, 5.0);
  for (std::size_t k = 50; k < 200; ++k) pv[k] = 6.0;
  for (std::size_t k = 100; k < 110; ++k) pv[k] = 8.0 - 0.2 * static_cast<double>(k - 100);
  for (std::size_t k = 150; k < 200; ++k) pv[k] = k < 153 ? 9.0 : 7.5;
  CHECK(gap::find_spikes(pv, 0.1, 10).count == 0);
}

TEST_CASE("a PV that jumps between two levels has no spikes, however short some stays are",
          "[gap][reading]") {
  std::vector<double> pv;
  for (const unsigned stay : {100U, 4U, 80U, 60U, 120U, 90U, 5U, 70U, 60U, 110U, 140U, 75U, 66U}) {
    pv.insert(pv.end(), stay, pv.empty() || pv.back() > 5.0 ? 4.5 : 5.5);
  }
  CHECK(gap::find_spikes(pv, 0.1, 10).count == 0);
  CHECK(gap::find_spikes(pv, 0.1, 200).count > 3);
}

}  // namespace reading_test
