// SPDX-License-Identifier: Apache-2.0
// `loopwardend --probe`: reads registers while a loop is being set up. It can only send read
// requests, so it writes to no device.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>

#include "base/file.hpp"
#include "hal/modbus/modbus_transport.hpp"
#include "daemon/protocol/probe.hpp"

namespace loopwarden::daemon::probe {

// Uses one line or connection at a time.
class Prober {
 public:
  // `folder`: configuration of a daemon that may run at the same time.
  explicit Prober(std::filesystem::path folder) : folder_(std::move(folder)) {}

  protocol::Probed read(const protocol::Probe& asked);

 private:
  // Locks the line. Returns why that failed; empty: the lock is held.
  std::string lock(const hal::modbus::LinkSettings& link);

  std::filesystem::path folder_;
  base::File line_;  // the locked line
  hal::modbus::BusWaiter waiter_;
  std::optional<hal::modbus::LinkSettings> link_;
  std::optional<hal::modbus::ModbusTransport> transport_;
};

// Answers the lines of `input` on standard output until `input` ends, or no line arrives for
// `patience`. Returns the exit code.
int serve(const std::filesystem::path& folder, int input, std::chrono::milliseconds patience);

}  // namespace loopwarden::daemon::probe
