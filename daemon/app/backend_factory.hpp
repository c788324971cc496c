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
class FeedTable;
}

namespace loopwarden::daemon {

// Makes the hardware backend of a loop's configuration, and owns what several loops share (a serial
// line). It must outlive every backend that it made.
class BackendFactory {
 public:
  BackendFactory();
  BackendFactory(const BackendFactory&) = delete;
  BackendFactory& operator=(const BackendFactory&) = delete;
  ~BackendFactory();

  // Makes the backend of a loop that is controlled here. Throws std::runtime_error if it can't
  // work.
  std::unique_ptr<hal::LoopIo> make(const config::LoopConfig& loop);
  // Makes the source of a loop that another controller runs. The table must outlive it.
  std::unique_ptr<hal::LoopSource> make_source(const config::LoopConfig& loop,
                                               hal::feed::FeedTable& board);
  // Log of links and analog channels.
  base::LimitedLog& log() noexcept { return log_; }

 private:
  base::LimitedLog log_;
  std::unique_ptr<hal::modbus::ModbusBus> bus_;
};

}  // namespace loopwarden::daemon
