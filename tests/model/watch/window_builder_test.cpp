// SPDX-License-Identifier: Apache-2.0
#include "model/watch/window_builder.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "model/watch/limits.hpp"

namespace window_builder_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;
using Progress = WindowBuilder::Progress;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Cycle cycle(std::uint64_t period) {
  const auto x = static_cast<double>(period);
  return {.period_index = period,
          .sp = x + 0.1,
          .pv = x + 0.2,
          .co = x + 0.3,
          .stem = x + 0.4,
          .automatic = true,
          .pv_good = true};
}

// Adds cycles from `from` up to before `to`; returns the periods at which windows were full.
std::vector<std::uint64_t> add(WindowBuilder& builder, std::uint64_t from, std::uint64_t to) {
  std::vector<std::uint64_t> full;
  for (std::uint64_t k = from; k < to; ++k) {
    const Progress progress = builder.add(cycle(k));
    CHECK(progress != Progress::broken);
    if (progress == Progress::full) full.push_back(k);
  }
  return full;
}

}  // namespace

TEST_CASE("windows follow one another with the requested overlap", "[monitor][window]") {
  for (const double overlap : {0.0, 0.5, 0.9}) {
    WindowBuilder builder({.overlap = overlap, .sample_time_s = 0.1});
    const auto full = add(builder, 1000, 1000 + 5 * kWindowSamples);
    REQUIRE(full.size() >= 5);
    CHECK(full.front() == 1000 + kWindowSamples - 1);
    const auto kept =
        static_cast<std::uint64_t>(std::lround(overlap * static_cast<double>(kWindowSamples)));
    for (std::size_t i = 1; i < full.size(); ++i) {
      CHECK(full[i] - full[i - 1] == kWindowSamples - kept);
    }
  }
}

TEST_CASE("a window holds the newest samples, in order, independent of earlier ones",
          "[monitor][window]") {
  WindowBuilder builder({.overlap = 0.9,
                         .sample_time_s = 0.1,
                         .pv_low = 1.0,
                         .pv_high = 2.0,
                         .co_low = 3.0,
                         .co_high = 4.0});
  std::size_t windows = 0;
  for (std::uint64_t k = 5; k < 5 + 4 * kWindowSamples; ++k) {
    if (builder.add(cycle(k)) != Progress::full) continue;
    ++windows;
    const alarm::Window w = builder.window();
    REQUIRE(w.pv.size() == kWindowSamples);
    REQUIRE(w.stem.size() == kWindowSamples);
    bool as_expected = true;
    for (std::size_t i = 0; i < kWindowSamples; ++i) {
      const auto x = static_cast<double>(k - (kWindowSamples - 1) + i);
      as_expected = as_expected && w.sp[i] == x + 0.1 && w.pv[i] == x + 0.2 && w.co[i] == x + 0.3 &&
                    w.stem[i] == x + 0.4;
    }
    CHECK(as_expected);
    CHECK(builder.last_period() == k);
    CHECK(w.period_s == 0.1);
    CHECK(w.pv_low == 1.0);
    CHECK(w.pv_high == 2.0);
    CHECK(w.co_low == 3.0);
    CHECK(w.co_high == 4.0);
  }
  CHECK(windows > 20);
}

TEST_CASE("decimation averages, so that a fast loop covers the same time", "[monitor][window]") {
  WindowBuilder builder({.overlap = 0.0, .decimation = 10, .sample_time_s = 0.01});
  const auto full = add(builder, 0, 10 * kWindowSamples);
  REQUIRE(full.size() == 1);
  CHECK(full.front() == 10 * kWindowSamples - 1);
  const alarm::Window w = builder.window();
  CHECK(w.period_s == Approx(0.1));
  CHECK(w.pv[0] == Approx(4.5 + 0.2));
  CHECK(w.pv[960] == Approx(9604.5 + 0.2));
}

TEST_CASE("never across a gap, a mode or a bad PV", "[monitor][window]") {
  WindowBuilder builder({.overlap = 0.5, .sample_time_s = 0.1});
  CHECK(builder.state() == alarm::WindowState::filling);
  REQUIRE(add(builder, 0, kWindowSamples).size() == 1);
  CHECK(builder.state() == alarm::WindowState::valid);

  // Some samples of the next window, then the event that breaks it.
  std::uint64_t next = kWindowSamples + 100;
  add(builder, kWindowSamples, next);
  Cycle bad = cycle(next);
  alarm::WindowState reason = alarm::WindowState::valid;
  SECTION("manual") {
    bad.automatic = false;
    reason = alarm::WindowState::not_automatic;
  }
  SECTION("bad PV") {
    bad.pv_good = false;
    reason = alarm::WindowState::bad_pv;
  }
  SECTION("PV that is no number, called good") {
    bad.pv = kNan;
    reason = alarm::WindowState::bad_pv;
  }
  SECTION("no output") {
    bad.co = kNan;
    reason = alarm::WindowState::gap;
  }
  SECTION("missing cycles, one more than can be bridged") {
    next += WatchLimits::kLongestBridge + 1;
    bad.period_index = next;
    reason = alarm::WindowState::gap;
  }
  CHECK(builder.add(bad) == Progress::broken);
  CHECK(builder.state() == reason);
  // Reported once, whatever its duration.
  if (builder.add(cycle(next + 1)) == Progress::none && reason != WindowState::gap) {
    CHECK(builder.state() == WindowState::filling);
  }
  // A whole window is collected again, without earlier samples.
  const auto full = add(builder, next + 2, next + 2 + 2 * kWindowSamples);
  REQUIRE_FALSE(full.empty());
  const alarm::Window w = builder.window();
  CHECK(full.front() >= next + kWindowSamples - 1);
  CHECK(w.pv.front() > static_cast<double>(next));
  CHECK(builder.state() == alarm::WindowState::valid);
}

TEST_CASE("late cycles are bridged, counted, and limited per window", "[monitor][window]") {
  const std::size_t decimation = GENERATE(std::size_t{1}, std::size_t{3});
  WindowBuilder builder({.overlap = 0.0, .decimation = decimation, .sample_time_s = 0.1});
  const auto longest = static_cast<std::uint64_t>(WatchLimits::kLongestBridge * decimation);
  std::uint64_t next = 0;
  const auto skip = [&](std::uint64_t missing) {
    next += 50 * decimation;
    for (std::uint64_t k = next - 50 * decimation; k < next; ++k) {
      if (builder.add(cycle(k)) != Progress::none) return Progress::broken;
    }
    next += missing;
    return builder.add(cycle(next++));
  };
  CHECK(skip(longest) == Progress::none);
  CHECK(skip(longest) == Progress::none);
  CHECK(skip(decimation) == Progress::none);  // as many as a window may have
  SECTION("enough") {
    std::uint64_t at = next;
    while (builder.add(cycle(at)) != Progress::full) ++at;
    const Window w = builder.window();
    CHECK(at == kWindowSamples * decimation - 1);  // as if no cycle were missing
    CHECK(w.bridged_cycles == WatchLimits::kMostBridged * decimation);
    // A straight rise is bridged by a straight line; SP and CO are held meanwhile.
    bool on_the_line = true;
    bool co_behind = false;
    for (std::size_t i = 1; i < kWindowSamples; ++i) {
      const double step = static_cast<double>(decimation);
      on_the_line = on_the_line && std::abs(w.pv[i] - w.pv[i - 1] - step) < 1e-9 &&
                    std::abs(w.stem[i] - w.stem[i - 1] - step) < 1e-9;
      co_behind = co_behind || w.co[i] - w.co[i - 1] < 0.5 * step;
    }
    CHECK(on_the_line);
    CHECK(co_behind);
    // The bridged cycles leave with their window.
    while (builder.add(cycle(++at)) != Progress::full) {
    }
    CHECK(builder.window().bridged_cycles == 0);
  }
  SECTION("one too many") {
    CHECK(skip(1) == Progress::broken);
    CHECK(builder.state() == alarm::WindowState::gap);
  }
}

TEST_CASE("a window that ends within a bridge is completed by the next cycle",
          "[monitor][window]") {
  WindowBuilder builder({.overlap = 0.5, .sample_time_s = 0.1});
  add(builder, 0, kWindowSamples - 2);
  CHECK(builder.add(cycle(kWindowSamples + 1)) == Progress::full);
  CHECK(builder.window().pv.size() == kWindowSamples);
  CHECK(builder.window().pv.back() == Approx(static_cast<double>(kWindowSamples + 1) + 0.2));
  CHECK(builder.window().bridged_cycles == 3);
  // The next window ends at its usual place.
  const auto full = add(builder, kWindowSamples + 2, 2 * kWindowSamples);
  REQUIRE(full.size() == 2);
  CHECK(full.front() == kWindowSamples - 1 + 480);
  CHECK(full.back() == kWindowSamples - 1 + 2 * 480);
}

TEST_CASE("a stretch that can't be used is reported once, and again when its reason changes",
          "[monitor][window]") {
  WindowBuilder builder({.overlap = 0.5, .sample_time_s = 0.1});
  Cycle c = cycle(1);
  c.automatic = false;
  CHECK(builder.add(c) == Progress::broken);
  c.period_index = 2;
  CHECK(builder.add(c) == Progress::none);
  c.period_index = 9;  // a gap within it is not reported
  CHECK(builder.add(c) == Progress::none);
  c.period_index = 10;
  c.automatic = true;
  c.pv_good = false;
  CHECK(builder.add(c) == Progress::broken);
  CHECK(builder.state() == alarm::WindowState::bad_pv);
}

TEST_CASE("a loop without read-back has a stem that is no number, and windows all the same",
          "[monitor][window]") {
  WindowBuilder builder({.overlap = 0.0, .sample_time_s = 0.1});
  bool full = false;
  for (std::uint64_t k = 0; k < kWindowSamples; ++k) {
    Cycle c = cycle(k);
    c.stem = kNan;
    full = builder.add(c) == Progress::full;
  }
  REQUIRE(full);
  CHECK(std::isnan(builder.window().stem[0]));
  CHECK(std::isnan(builder.window().stem[960]));
}

TEST_CASE("settings outside their ranges do no harm", "[monitor][window]") {
  WindowBuilder builder({.overlap = 5.0, .decimation = 0, .sample_time_s = 0.1});
  CHECK(add(builder, 0, 2 * kWindowSamples).size() > 1);
  WindowBuilder other({.overlap = kNan, .decimation = 1, .sample_time_s = 0.1});
  CHECK(add(other, 0, 2 * kWindowSamples).size() == 2);
}

}  // namespace window_builder_test
