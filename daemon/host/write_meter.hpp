// SPDX-License-Identifier: Apache-2.0
// Measures how much the daemon writes to disks, per day.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace loopwarden::daemon::host {

// Bytes that this process has passed to disks since its start; nullopt if the kernel does not
// report them. Metadata of the file system and files in memory are not included.
std::optional<std::uint64_t> bytes_written();

struct WriteRate {
  std::uint64_t bytes = 0;          // since the start
  std::optional<double> per_day_b;  // B per day, over at most the last hour; nullopt: not known yet
  bool full_hour = false;           // per_day_b is that of a whole hour
};

// Not for several threads. It uses no clock.
class WriteMeter {
 public:
  static constexpr std::int64_t kWindow_ms = 3'600'000;
  static constexpr std::int64_t kShortest_ms = 60'000;  // before a rate is given

  WriteRate add(std::int64_t monotonic_ms, std::uint64_t bytes);

 private:
  struct Sample {
    std::int64_t at_ms = 0;
    std::uint64_t bytes = 0;
  };
  std::deque<Sample> samples_;  // the first is at least as old as the window, if there is one
};

}  // namespace loopwarden::daemon::host
