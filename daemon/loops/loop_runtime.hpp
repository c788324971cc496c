// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "config/loop_config.hpp"
#include "daemon/rt/control_cycle.hpp"
#include "hal/contract/loop_io.hpp"

namespace loopwarden::daemon {

// The settings in force: a reload or a Modbus master changes them while others look.
class CurrentSettings {
 public:
  explicit CurrentSettings(const rt::LoopSettings& settings) : settings_(settings) {}
  rt::LoopSettings get() const {
    const std::lock_guard lock(mutex_);
    return settings_;
  }
  void set(const rt::LoopSettings& settings) {
    const std::lock_guard lock(mutex_);
    settings_ = settings;
  }
  template <class Change>
  void change(Change change) {
    const std::lock_guard lock(mutex_);
    change(settings_);
  }

 private:
  mutable std::mutex mutex_;
  rt::LoopSettings settings_;
};

// One configured loop while the daemon runs: its configuration, backend, channels and cycle.
struct LoopRuntime {
  config::LoopConfig config;  // as at start; what a reload may change is in `settings`
  std::unique_ptr<CurrentSettings> settings;
  std::unique_ptr<hal::LoopIo> io;
  std::unique_ptr<rt::LoopChannels> channels;
  std::unique_ptr<rt::ControlCycle> cycle;
};

rt::LoopSettings settings_of(const config::LoopConfig& config);

}  // namespace loopwarden::daemon
