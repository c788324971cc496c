// SPDX-License-Identifier: Apache-2.0
// Whether the master that leads the loops is still there.
#pragma once

#include <cstdint>

namespace loopwarden::daemon::gateway {

enum class MasterLossAction : std::uint8_t {
  report,     // the bit and the journal, nothing else
  manual,     // every loop to manual, the output stays where it stands
  automatic,  // every loop to automatic, on the last set point
};

struct MasterHeartbeatSettings {
  double timeout_s = 0.0;  // s; 0: not watched
  MasterLossAction action = MasterLossAction::report;

  friend bool operator==(const MasterHeartbeatSettings&, const MasterHeartbeatSettings&) = default;
};

// Armed by the first heartbeat: a master that never was there can't be lost.
//
// What stops the server for a while keeps the master's heartbeats in the sockets. Such a pause counts as kLongestRound,
// and the round after it judges nobody: the one that follows has read what was waiting. A machine on which every round is
// late still has its master watched, since each of them reads the sockets.
class MasterWatch {
 public:
  static constexpr std::int64_t kLongestRound = 250'000'000;  // ns

  explicit MasterWatch(const MasterHeartbeatSettings& settings) noexcept : settings_(settings) {}

  enum class Event : std::uint8_t { none, lost, back };
  // Once a round. All that had come before `read_ns` has been read; `value` is what the master wrote last, and only a
  // change is a sign of life.
  Event step(std::int64_t read_ns, bool written, std::uint16_t value) noexcept;
  bool lost() const noexcept { return lost_; }

 private:
  MasterHeartbeatSettings settings_;
  bool armed_ = false;
  bool lost_ = false;
  bool late_ = false;  // the round before
  std::uint16_t last_value_ = 0;
  std::int64_t silent_ns_ = 0;
  std::int64_t last_read_ns_ = 0;
};

}  // namespace loopwarden::daemon::gateway
