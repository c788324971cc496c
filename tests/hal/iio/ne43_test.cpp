// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/ne43.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace ne43_test {

using namespace loopwarden::hal;
using loopwarden::hal::iio::Ne43;
using loopwarden::hal::iio::Ne43Settings;

namespace {

constexpr std::int64_t kStep = 100'000'000;  // ns between samples

// The reading after the current was constant for `samples` samples.
struct Feed {
  Ne43 ne43;
  std::int64_t now = 0;
  Ne43::Reading operator()(double current_ma, int samples = 1) {
    Ne43::Reading reading;
    for (int i = 0; i < samples; ++i) reading = ne43.step(current_ma, now += kStep);
    return reading;
  }
};

}  // namespace

TEST_CASE("each band of current has its quality and limit") {
  struct Case {
    double current_ma;
    Quality quality;
    Reason reason;
    Limit limit;
    bool fresh;
  };
  const Case cases[] = {
      {3.6, Quality::uncertain, Reason::out_of_range, Limit::low, false},
      {3.79, Quality::uncertain, Reason::out_of_range, Limit::low, false},
      {3.8, Quality::good, Reason::none, Limit::low, true},
      {3.99, Quality::good, Reason::none, Limit::low, true},
      {4.0, Quality::good, Reason::none, Limit::none, true},
      {12.0, Quality::good, Reason::none, Limit::none, true},
      {20.0, Quality::good, Reason::none, Limit::none, true},
      {20.01, Quality::good, Reason::none, Limit::high, true},
      {20.5, Quality::good, Reason::none, Limit::high, true},
      {20.51, Quality::uncertain, Reason::out_of_range, Limit::high, false},
      {21.0, Quality::uncertain, Reason::out_of_range, Limit::high, false},
  };
  for (const Case& c : cases) {
    Feed feed{Ne43(Ne43Settings{})};
    feed(12.0);
    const Ne43::Reading reading = feed(c.current_ma, 100);
    INFO(c.current_ma);
    CHECK(reading.quality == c.quality);
    CHECK(reading.reason == c.reason);
    CHECK(reading.limit == c.limit);
    CHECK(reading.fresh == c.fresh);
  }
}

TEST_CASE(
    "a failure current turns bad after three samples in a row, held and uncertain until then") {
  for (const double current_ma : {3.59, 0.0, -1.0, 21.01, 24.0, std::nan("")}) {
    INFO(current_ma);
    Feed feed{Ne43(Ne43Settings{})};
    feed(12.0);
    CHECK(feed(current_ma).quality == Quality::uncertain);
    const Ne43::Reading second = feed(current_ma);
    CHECK(second.quality == Quality::uncertain);
    CHECK(second.reason == Reason::sensor_failure);
    CHECK_FALSE(second.fresh);
    const Ne43::Reading third = feed(current_ma);
    CHECK(third.quality == Quality::bad);
    CHECK(third.reason == Reason::sensor_failure);
    CHECK_FALSE(third.fresh);
  }
}

TEST_CASE("failures that are not in a row don't add up") {
  Feed feed{Ne43(Ne43Settings{})};
  feed(12.0);
  for (int i = 0; i < 20; ++i) {
    CHECK(feed(0.0, 2).quality == Quality::uncertain);
    CHECK(feed(12.0).quality == Quality::good);
  }
}

TEST_CASE("bad is left after two seconds without a break inside the measuring range") {
  Feed feed{Ne43(Ne43Settings{})};
  feed(12.0);
  feed(0.0, 3);
  CHECK(feed(12.0, 20).quality == Quality::bad);  // 1.9 s from the first to the last
  CHECK(feed(12.0).quality == Quality::good);
}

TEST_CASE("a break begins the two seconds again") {
  for (const double current_ma : {3.7, 20.7, 0.0}) {
    INFO(current_ma);
    Feed feed{Ne43(Ne43Settings{})};
    feed(12.0);
    feed(0.0, 3);
    feed(12.0, 15);
    CHECK(feed(current_ma).quality == Quality::bad);
    CHECK(feed(12.0, 20).quality == Quality::bad);
    CHECK(feed(12.0).quality == Quality::good);
  }
  Feed feed{Ne43(Ne43Settings{})};
  feed(0.0);
  feed(12.0, 15);
  feed.ne43.interrupted();
  CHECK(feed(12.0, 20).quality == Quality::bad);
  CHECK(feed(12.0).quality == Quality::good);
}

TEST_CASE("at start a measurement counts at once, and a failure too") {
  Feed good{Ne43(Ne43Settings{})};
  CHECK(good(12.0).quality == Quality::good);
  Feed failed{Ne43(Ne43Settings{})};
  CHECK(failed(0.0).quality == Quality::bad);
  // No earlier value can be held, so no uncertain value may result.
  Feed undefined{Ne43(Ne43Settings{})};
  CHECK(undefined(3.7).quality == Quality::bad);
  CHECK(undefined(12.0).quality == Quality::good);
}

TEST_CASE("limits, entry and recovery are settings") {
  Ne43Settings settings;
  settings.limits = {3.5, 3.75, 21.0, 21.75};
  settings.entry_samples = 1;
  settings.recovery_s = 0.0;
  Feed feed{Ne43(settings)};
  CHECK(feed(3.75).quality == Quality::good);
  CHECK(feed(21.0).quality == Quality::good);
  CHECK(feed(21.7).quality == Quality::uncertain);
  CHECK(feed(3.5).quality == Quality::uncertain);
  CHECK(feed(3.4).quality == Quality::bad);
  CHECK(feed(12.0).quality == Quality::good);
}

}  // namespace ne43_test
