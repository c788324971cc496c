// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/interlocks.hpp"
#include "config/loop_config.hpp"
#include "daemon/rt/control_cycle.hpp"
#include "daemon/watch/watch_cycle.hpp"
#include "hal/contract/loop_io.hpp"
#include "hal/contract/loop_source.hpp"

namespace loopwarden::daemon {

// The settings in force, as the loop's cycle tells them: what a reload or a Modbus master asks for is
// shown once it is so. Any thread but the real-time one; the one reader of `in_force`.
class CurrentSettings {
 public:
  CurrentSettings(const rt::LoopSettings& settings, rt::LoopChannels& channels)
      : channels_(channels), settings_(settings) {}
  rt::LoopSettings get() const {
    const std::lock_guard lock(mutex_);
    channels_.in_force.fetch(settings_);
    return settings_;
  }

 private:
  rt::LoopChannels& channels_;
  mutable std::mutex mutex_;
  mutable rt::LoopSettings settings_;
};

// One configured loop while the daemon runs: its configuration, backend, channels and cycle. One that is controlled here
// has `io` and `cycle`, one that another controller runs has `source` and `watch`.
struct LoopRuntime {
  config::LoopConfig config;  // as at start; what a reload may change is in `settings`
  std::unique_ptr<hal::LoopIo> io;
  std::unique_ptr<hal::LoopSource> source;
  std::unique_ptr<rt::LoopChannels> channels;
  std::unique_ptr<CurrentSettings> settings;
  std::unique_ptr<rt::ControlCycle> cycle;
  std::unique_ptr<watch::WatchCycle> watch;

  bool watched() const noexcept { return source != nullptr; }
  hal::Device& device() const noexcept {
    return watched() ? static_cast<hal::Device&>(*source) : *io;
  }
};

// The loop of this name; nullopt if there is none.
std::optional<std::size_t> find_loop(const std::vector<LoopRuntime>& loops,
                                     const std::string& name);

// `backing`: of the backend that runs.
rt::LoopSettings settings_of(const config::LoopConfig& config, config::Backing backing);

}  // namespace loopwarden::daemon
