// SPDX-License-Identifier: Apache-2.0
// The common interface of devices between a loop and the field, for those that are written and
// those that are only read.
#pragma once

#include <cstdint>

namespace loopwarden::hal {

// Counters for status and events. They only increase; one backend thread writes each.
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

  // Starts the backend. A device that does not answer is no error: its samples are bad until it
  // answers. Throws std::runtime_error only for faults that can't be cured while it runs.
  virtual void open() = 0;

  // Stops the backend's threads. The device keeps its last command.
  virtual void close() noexcept = 0;

  // --- any thread ----------------------------------------------------------------------------

  virtual IoCounters counters() const noexcept = 0;

  // Returns a number that grows while the backend's own thread is alive, also while it waits for a
  // dead device. Watched only if has_thread() is true.
  virtual bool has_thread() const noexcept { return false; }
  virtual std::uint64_t ticks() const noexcept { return 0; }
};

}  // namespace loopwarden::hal
