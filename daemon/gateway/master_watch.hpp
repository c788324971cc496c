// SPDX-License-Identifier: Apache-2.0
// Detects the loss of the master that supervises the loops.
#pragma once

#include <cstdint>

namespace loopwarden::daemon::gateway {

enum class MasterLossAction : std::uint8_t {
  report,     // sets the bit and writes to the journal only
  manual,     // every loop to manual; the output keeps its value
  automatic,  // every loop to automatic, at the last set point
};

struct MasterHeartbeatSettings {
  double timeout_s = 0.0;  // s; 0: not supervised
  MasterLossAction action = MasterLossAction::report;

  friend bool operator==(const MasterHeartbeatSettings&, const MasterHeartbeatSettings&) = default;
};

// The first heartbeat arms it, so a master that was never there can't be lost.
//
// If the server pauses, the master's heartbeats wait in the sockets. Such a pause counts as
// kLongestRound. The round after it does not report a loss, because the next round first reads the
// waiting heartbeats. On a host where every round is late, the master is still supervised, because
// each round reads the sockets.
class MasterWatch {
 public:
  static constexpr std::int64_t kLongestRound = 250'000'000;  // ns

  explicit MasterWatch(const MasterHeartbeatSettings& settings) noexcept : settings_(settings) {}

  enum class Event : std::uint8_t { none, lost, back };
  // Call it once per round. All heartbeats that arrived before `read_ns` have been read. `value`:
  // the master's last value. Only a changed value is a sign of life.
  Event step(std::int64_t read_ns, bool written, std::uint16_t value) noexcept;
  bool lost() const noexcept { return lost_; }

 private:
  MasterHeartbeatSettings settings_;
  bool armed_ = false;
  bool lost_ = false;
  bool late_ = false;  // the previous round was late
  std::uint16_t last_value_ = 0;
  std::int64_t silent_ns_ = 0;
  std::int64_t last_read_ns_ = 0;
};

}  // namespace loopwarden::daemon::gateway
