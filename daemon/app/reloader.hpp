// SPDX-License-Identifier: Apache-2.0
// Carries out reloads one after the other, from SIGHUP and from `loopwarden reload`. The thread
// lw-reload reads the files, because it may hang on the disk. The main thread plans (reload.hpp),
// offers the settings to the loops' cycles and records their answers.
//
// While a loop is being commissioned, files are refused. The newest refused reload is kept. It is
// carried out after the commissioning, with the files of that time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/loop_config.hpp"
#include "daemon/app/configuration_files.hpp"
#include "daemon/app/reload.hpp"
#include "daemon/app/reload_queue.hpp"
#include "daemon/app/reload_status.hpp"
#include "daemon/app/settings_offers.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/recorder/historian.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

struct ReloaderCallbacks {
  // Takes the applied keys of loopwardend.yaml. Main thread.
  std::function<void(const config::DaemonConfig&)> take_over;
  // Notify the service manager. Main thread.
  std::function<void()> reloading;
  std::function<void()> ready;
};

class Reloader {
 public:
  // `started`: configuration of the start. The other arguments must outlive this. The loops may be
  // made later, before step().
  Reloader(const config::Configuration& started, std::filesystem::path folder,
           std::vector<LoopRuntime>& loops, const Historian& historian, journal::Journal& journal,
           ReloaderCallbacks callbacks);
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

  void start() { files_.start(); }
  void stop() { files_.stop(); }
  // Does the same as stop(), but waits for the disk for at most `patience`. Returns false if it
  // hangs.
  bool stop_for(std::chrono::milliseconds patience) { return files_.stop_for(patience); }

  // Main thread: by_signal() handles SIGHUP; step() runs periodically.
  void by_signal() { queue_.by_signal(); }
  void step();

  // From any thread, see ReloadQueue.
  std::uint64_t post(const std::string& peer, bool dry_run, bool take_file) {
    return queue_.post(peer, dry_run, take_file);
  }
  std::optional<protocol::ReloadState> state(std::uint64_t number) const {
    return queue_.state(number);
  }
  // See ReloadStatus.
  protocol::ConfigurationStatus status() const { return status_.get(); }
  std::uint32_t config_hash() const noexcept { return status_.config_hash(); }

 private:
  // The reload in progress.
  struct Current {
    std::shared_ptr<ReloadJob> job;  // null: no reload in progress
    std::uint32_t hash_before = 0;
    bool replaces_gains = false;  // those set by a user
    std::optional<std::vector<protocol::Diagnostic>> diagnostics;
    std::chrono::steady_clock::time_point taking_since{};
  };

  void begin();
  void resume_kept();
  void look_at_files();
  void take(const ReadFiles& read);
  std::vector<reload::Output> outputs() const;
  void follow_offers();
  void finish_taking();
  void refuse(const ReadFiles& read);
  void refuse(const std::string& why, std::vector<std::string> lines,
              protocol::ReloadOutcome result);
  void note_gains_of_file(const config::Configuration& wanted);
  void finish(protocol::ReloadOutcome result, std::uint64_t journal_ticket = 0);
  std::uint64_t write_down(const std::string& result) const;
  config::Configuration in_force() const;
  reload::Output output(std::size_t loop) const;

  config::DaemonConfig running_;  // loopwardend.yaml in force
  std::vector<LoopRuntime>& loops_;
  const Historian& historian_;
  journal::Journal& journal_;
  ReloaderCallbacks callbacks_;
  ConfigurationFiles files_;
  SettingsOffers offers_;
  ReloadQueue queue_;
  ReloadStatus status_;
  reload::Plan plan_;             // plan of the last accepted reload, with its progress
  config::Configuration wanted_;  // from the last accepted reload
  Current current_;
  std::optional<ReloadQueue::Kept> kept_;  // kept until no loop is being commissioned
};

}  // namespace loopwarden::daemon
