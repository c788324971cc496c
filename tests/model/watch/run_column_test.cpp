// SPDX-License-Identifier: Apache-2.0
#include "model/watch/run_column.hpp"

#include <malloc.h>

#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "model/watch/loop_monitor.hpp"

namespace loopwarden::tests::run_column_test {
namespace {

using watch::RunColumn;

std::vector<std::uint32_t> bits(const std::vector<float>& samples) {
  std::vector<std::uint32_t> all;
  for (const float sample : samples) all.push_back(std::bit_cast<std::uint32_t>(sample));
  return all;
}

TEST_CASE("a column of runs has the bits of its newest samples", "[routine]") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> samples{1.0F, 1.0F, 1.0F, 0.0F, -0.0F, kNan, kNan, 2.0F, 2.0F, 1.0F};
  RunColumn column;
  for (const float sample : samples) column.push(sample);
  for (std::size_t count = 0; count <= samples.size(); ++count) {
    const std::vector<float> newest(samples.end() - static_cast<std::ptrdiff_t>(count),
                                    samples.end());
    CHECK(bits(column.newest(count)) == bits(newest));
    RunColumn kept = column;
    kept.keep_newest(count);
    CHECK(bits(kept.newest(samples.size())) == bits(newest));
    kept.push(3.0F);
    CHECK(kept.newest(1) == std::vector<float>{3.0F});
    CHECK(kept.newest(samples.size() + 1).size() == count + 1);
  }
  column.clear();
  CHECK(column.newest(5).empty());
}

// A sanitizer has an allocator that reports no sizes: then this checks nothing.
TEST_CASE("the monitor of a loop takes at most 90 kB", "[monitor][memory]") {
  constexpr std::size_t kLoops = 20;
  constexpr std::size_t kCycles = 3000;  // three windows, and four of the finest routine evidence
  const std::size_t before = mallinfo2().uordblks;
  std::vector<std::unique_ptr<watch::LoopMonitor>> loops;
  for (std::size_t i = 0; i < kLoops; ++i) {
    loops.push_back(std::make_unique<watch::LoopMonitor>(
        watch::WindowSettings{.sample_time_s = 1.0}, alarm::kAlarmRule, nullptr));
    for (std::size_t k = 0; k < kCycles; ++k) {
      loops.back()->add({.period_index = k,
                         .sp = 50.0,
                         .pv = 50.0 + static_cast<double>(k % 7),
                         .co = 40.0,
                         .stem = 40.0,
                         .automatic = true,
                         .pv_good = true});
    }
  }
  const std::size_t after = mallinfo2().uordblks;
  CHECK(after < before + kLoops * 90'000);
}

}  // namespace
}  // namespace loopwarden::tests::run_column_test
