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

// The settings in force, as reported by the loop's cycle. Changes by a reload or a Modbus master
// appear when they are in force. It must be the only reader of `in_force`. For any thread except
// the real-time one.
class CurrentSettings {
 public:
  // `settings`: those of the files.
  CurrentSettings(const rt::LoopSettings& settings, rt::LoopChannels& channels)
      : channels_(channels), settings_(settings), file_(settings.controller.pid.gains) {}
  rt::LoopSettings get() const {
    const std::lock_guard lock(mutex_);
    channels_.in_force.fetch(settings_);
    return settings_;
  }

  // The author of the last commanded gains. A reload replaces gains set by a user only if
  // requested. A Modbus master may write its gains again at any time.
  struct GainsAuthor {
    std::string by;
    std::int64_t utc_ms = 0;
    bool person = false;
  };
  void gains_ordered(GainsAuthor author);
  // The file's gains are in force.
  void gains_of_file(const control::PidGains& gains);
  // Gains in force that are not in the loop's file, with the file's gains, which a restart uses.
  struct GainsNotInFile {
    control::PidGains file;
    GainsAuthor author;
  };
  std::optional<GainsNotInFile> gains_not_in_file() const;

 private:
  std::optional<GainsNotInFile> not_in_file() const;  // call it with mutex_ held

  rt::LoopChannels& channels_;
  mutable std::mutex mutex_;
  mutable rt::LoopSettings settings_;
  control::PidGains file_;
  GainsAuthor author_;
};

// A configured loop while the daemon runs: its configuration, backend, channels and cycle. A loop
// controlled here has `io` and `cycle`. A loop that another controller runs has `source` and
// `watch`.
struct LoopRuntime {
  // configuration of the start; values that a reload may change are in `settings`
  config::LoopConfig config;
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

// Returns the loop of this name; nullopt if it does not exist.
std::optional<std::size_t> find_loop(const std::vector<LoopRuntime>& loops,
                                     const std::string& name);

// `backing`: that of the running backend.
rt::LoopSettings settings_of(const config::LoopConfig& config, config::Backing backing);

}  // namespace loopwarden::daemon
