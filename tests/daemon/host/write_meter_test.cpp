// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/write_meter.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::daemon::write_meter_test {
namespace {

using host::WriteMeter;
using host::WriteRate;

TEST_CASE("the rate of writes is that of the last hour, and not known in the first minute",
          "[box]") {
  WriteMeter meter;
  CHECK_FALSE(meter.add(0, 5'000'000).per_day_b);
  CHECK_FALSE(meter.add(59'999, 5'000'000).per_day_b);
  // 1 kB/s
  WriteRate rate{};
  std::int64_t now_ms = 60'000;
  for (; now_ms < WriteMeter::kWindow_ms; now_ms += 5'000) {
    rate = meter.add(now_ms, 5'000'000 + static_cast<std::uint64_t>(now_ms));
    CHECK_FALSE(rate.full_hour);
  }
  CHECK(*rate.per_day_b == Approx(86.4e6));
  CHECK(rate.bytes == 5'000'000 + static_cast<std::uint64_t>(now_ms) - 5'000);
  // Then nothing for an hour.
  for (const std::int64_t end_ms = now_ms + WriteMeter::kWindow_ms; now_ms <= end_ms;
       now_ms += 5'000) {
    rate = meter.add(now_ms, 8'595'000);
  }
  CHECK(rate.full_hour);
  CHECK(*rate.per_day_b == Approx(0.0).margin(1e5));
}

TEST_CASE("the kernel reports the writes of this process", "[box]") {
  const std::optional<std::uint64_t> before = host::bytes_written();
  const std::optional<std::uint64_t> after = host::bytes_written();
  if (!before || !after) {
    WARN("not checked: this kernel has no /proc/self/io");
    return;
  }
  CHECK(*after >= *before);
}

}  // namespace
}  // namespace loopwarden::daemon::write_meter_test
