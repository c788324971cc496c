// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/loop_config.hpp"
#include "hal/contract/loop_io.hpp"

namespace loopwarden::hal::modbus {
class ModbusBus;
}

namespace loopwarden::daemon {

// Makes the hardware backend that a loop's configuration asks for, and keeps what several loops
// share (a serial line). Outlives every backend it made.
class BackendFactory {
 public:
  BackendFactory();
  BackendFactory(const BackendFactory&) = delete;
  BackendFactory& operator=(const BackendFactory&) = delete;
  ~BackendFactory();

  // Throws std::runtime_error for what can't work.
  std::unique_ptr<hal::LoopIo> make(const config::LoopConfig& loop);

 private:
  std::unique_ptr<hal::modbus::ModbusBus> bus_;
};

}  // namespace loopwarden::daemon
