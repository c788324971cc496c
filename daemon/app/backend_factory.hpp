// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/limited_log.hpp"
#include "config/loop_config.hpp"
#include "hal/contract/loop_io.hpp"
#include "hal/contract/loop_source.hpp"

namespace loopwarden::hal::modbus {
class ModbusBus;
}
namespace loopwarden::hal::feed {
class FeedBoard;
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

  // Of a loop controlled here. Throws std::runtime_error for what can't work.
  std::unique_ptr<hal::LoopIo> make(const config::LoopConfig& loop);
  // Of a loop that another controller runs; `board` outlives it.
  std::unique_ptr<hal::LoopSource> make_source(const config::LoopConfig& loop,
                                               hal::feed::FeedBoard& board);
  // Of links and analog channels.
  base::LimitedLog& log() noexcept { return log_; }

 private:
  base::LimitedLog log_;
  std::unique_ptr<hal::modbus::ModbusBus> bus_;
};

}  // namespace loopwarden::daemon
