// SPDX-License-Identifier: Apache-2.0
// What the daemon does alike with all that stands between a loop and the world, written to or only read.
#pragma once

#include <cstdint>

namespace loopwarden::hal {

// Counters for status and events; monotonically increasing, written by one backend thread each.
struct IoCounters {
  std::uint64_t transactions = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t device_exceptions = 0;
  std::uint64_t invalid_replies = 0;
  std::uint64_t stale_replies_discarded = 0;
  std::uint64_t reconnects = 0;
  std::uint64_t writes = 0;
  std::uint64_t write_errors = 0;
  std::uint64_t old_commands_withheld = 0;
  bool connected = false;
};

class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  virtual ~Device() = default;

  // --- set-up thread, may block and allocate -------------------------------------------------

  // Starts whatever the backend needs. A device that does not answer is no error: it shows as a
  // bad sample until it does. Throws std::runtime_error only for what can't work later either.
  virtual void open() = 0;

  // Stops the backend's threads. The device keeps its last command.
  virtual void close() noexcept = 0;

  // --- any thread ----------------------------------------------------------------------------

  virtual IoCounters counters() const noexcept = 0;

  // A number that grows while the backend's own thread is alive, also while it waits for a dead
  // device. Watched only where has_thread() is true.
  virtual bool has_thread() const noexcept { return false; }
  virtual std::uint64_t ticks() const noexcept { return 0; }
};

}  // namespace loopwarden::hal
