// SPDX-License-Identifier: Apache-2.0
// Status of a host process as text in the format of Prometheus (0.0.4).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "services/fleet/host/ingest.hpp"

namespace loopwarden::fleet {

// The delay from the time in a message until its row is visible in the database.
class DelayHistogram {
 public:
  static constexpr std::array kEdgesS{0.005, 0.01, 0.02, 0.05, 0.1,  0.2,  0.5,
                                      1.0,   2.0,  5.0,  10.0, 30.0, 60.0, 300.0};

  void add(double delay_s) noexcept;
  std::uint64_t count() const noexcept { return count_; }
  double sum_s() const noexcept { return sum_s_; }
  std::uint64_t in_bin(std::size_t bin) const noexcept { return bins_[bin]; }

 private:
  std::array<std::uint64_t, kEdgesS.size() + 1> bins_{};
  std::uint64_t count_ = 0;
  double sum_s_ = 0.0;
};

struct GroupStatus {
  std::string group;  // empty: all groups
  bool owned = false;
  bool broker_connected = false;
  bool database_connected = false;
  bool accepting = true;
  std::uint64_t broker_connections = 0;
  std::uint64_t edges = 0;
  std::uint64_t edges_online = 0;
  IngestCounts counts;
  std::uint64_t values_written = 0;
  std::uint64_t values_duplicate = 0;
  std::uint64_t rejected = 0;  // messages that the database refuses at every attempt
  std::uint64_t commits = 0;
  double commit_s = 0.0;  // sum
  std::uint64_t spool_messages = 0;
  std::uint64_t spool_bytes = 0;  // on the disk
  std::uint64_t spool_dropped = 0;
  DelayHistogram delay;
};

std::string metrics_text(const std::vector<GroupStatus>& groups);

}  // namespace loopwarden::fleet
