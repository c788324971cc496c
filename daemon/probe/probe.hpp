// SPDX-License-Identifier: Apache-2.0
// `loopwardend --probe`: reads registers for who sets a loop up. It writes to no device: all it can send is a read request.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>

#include "base/file.hpp"
#include "hal/modbus/modbus_transport.hpp"
#include "daemon/protocol/probe.hpp"

namespace loopwarden::daemon::probe {

// One line, one connection at a time.
class Prober {
 public:
  // `folder`: configuration of the daemon that may run beside it.
  explicit Prober(std::filesystem::path folder) : folder_(std::move(folder)) {}

  protocol::Probed read(const protocol::Probe& asked);

 private:
  // Why the line's lock can't be had; empty: it is held from now on.
  std::string lock(const hal::modbus::LinkSettings& link);

  std::filesystem::path folder_;
  base::File line_;  // with its lock
  hal::modbus::BusWaiter waiter_;
  std::optional<hal::modbus::LinkSettings> link_;
  std::optional<hal::modbus::ModbusTransport> transport_;
};

// Answers lines of `input` on the standard output until it ends, or nothing comes for so long. Returns the exit code.
int serve(const std::filesystem::path& folder, int input, std::chrono::milliseconds patience);

}  // namespace loopwarden::daemon::probe
