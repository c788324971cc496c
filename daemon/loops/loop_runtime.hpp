// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/interlocks.hpp"
#include "config/loop_config.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/rt/control_cycle.hpp"
#include "daemon/external/watch_cycle.hpp"
#include "hal/contract/loop_io.hpp"
#include "hal/contract/loop_source.hpp"

namespace loopwarden::daemon {

// The settings in force, as the loop's cycle tells them: what a reload or a Modbus master asks for is
// shown once it is so. Any thread but the real-time one; the one reader of `in_force`.
class CurrentSettings {
 public:
  // `settings` are those of the files.
  CurrentSettings(const rt::LoopSettings& settings, rt::LoopChannels& channels)
      : channels_(channels), settings_(settings), file_(settings.controller.pid.gains) {}
  rt::LoopSettings get() const {
    const std::lock_guard lock(mutex_);
    channels_.in_force.fetch(settings_);
    return settings_;
  }

  // Who has ordered gains last. A person's are not taken back by a reload unless he says so; a Modbus master, who
  // may write at any time, keeps his by himself.
  struct GainsAuthor {
    std::string by;
    std::int64_t utc_ms = 0;
    bool person = false;
  };
  void gains_ordered(GainsAuthor author);
  // The file's gains have come into force, or are those in force.
  void gains_of_file(const control::PidGains& gains);
  // Gains in force that the loop's file does not have: what a restart takes instead.
  struct GainsNotInFile {
    control::PidGains file;
    GainsAuthor author;
  };
  std::optional<GainsNotInFile> gains_not_in_file() const;

 private:
  std::optional<GainsNotInFile> not_in_file() const;  // with mutex_

  rt::LoopChannels& channels_;
  mutable std::mutex mutex_;
  mutable rt::LoopSettings settings_;
  control::PidGains file_;
  GainsAuthor author_;
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
  std::unique_ptr<external::WatchCycle> watch;
  std::unique_ptr<Commissioning> commissioning;

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
