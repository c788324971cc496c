// SPDX-License-Identifier: Apache-2.0
// Carries reloads out, one after the other: SIGHUP and `loopwarden reload` alike. The files are read by
// lw-reload, which may hang on the disk; the main thread plans (reload.hpp), offers the settings to the
// loops' cycles and takes down what each of them says.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "daemon/app/reload.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/recorder/disk_errand.hpp"
#include "daemon/recorder/historian.hpp"
#include "protocol/answers.hpp"

namespace loopwarden::daemon {

struct ReloaderEnds {
  // What is applied of loopwardend.yaml; main thread.
  std::function<void(const config::DaemonConfig&)> take_over;
  // For the service manager; main thread.
  std::function<void()> reloading;
  std::function<void()> ready;
};

class Reloader {
 public:
  // `started`: as at the start. The others outlive this; the loops may come later, before step().
  Reloader(const config::Configuration& started, std::filesystem::path folder,
           std::vector<LoopRuntime>& loops, const Historian& historian, journal::Journal& journal,
           ReloaderEnds ends);
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

  void start() { reader_.start(); }
  void stop() { reader_.stop(); }
  // As stop(), but waits for the disk for at most `patience`; false if it hangs.
  bool stop_for(std::chrono::milliseconds patience) { return reader_.stop_for(patience); }

  // Main thread: SIGHUP; a look at what goes on, again and again.
  void by_signal();
  void step();

  // Any thread. The number to ask for with state(); throws std::runtime_error where too many wait.
  std::uint64_t post(const std::string& peer, bool dry_run);
  // Nothing: there is no such reload any more.
  std::optional<protocol::ReloadState> state(std::uint64_t number) const;
  // For the status: which files are in force, and what waits.
  protocol::ConfigurationStatus status() const;
  // Of what is in force; of no set of files while something waits.
  std::uint32_t config_hash() const noexcept { return config_hash_.load(); }

 private:
  enum class State : std::uint8_t { waiting, reading, taking, done };
  struct Job {
    std::uint64_t number = 0;
    std::string peer;
    bool by_signal = false;
    bool dry_run = false;
    State state = State::waiting;
    protocol::ReloadOutcome result;  // once it is done
    std::uint64_t journal_ticket = 0;
  };
  // What the errand of lw-reload fills in.
  struct ReadFiles {
    config::Loaded<config::Configuration> files;
    std::string error;  // why they could not be read at all
    std::atomic<bool> there{false};
  };
  // Settings that a loop's cycle has not taken yet.
  struct Offer {
    std::size_t loop = 0;       // of those that run
    std::size_t plan_loop = 0;  // of plan_
    std::uint32_t number = 0;
    bool judged = false;  // the cycle has looked at it
    bool taken = false;   // and taken it
    config::LoopConfig wanted;
  };

  std::shared_ptr<Job> next_job();
  void begin_reading();
  void look_at_reading();
  void take(const ReadFiles& read);
  void offer(reload::Plan plan, const config::Configuration& wanted);
  void follow_offers();
  void finish_taking();
  void refuse(const ReadFiles& read);
  void finish(protocol::ReloadOutcome result);
  void set_state(State state);
  std::uint64_t write_down(const Job& job, const std::string& result) const;
  void publish();
  config::Configuration in_force() const;
  std::vector<reload::Output> outputs() const;

  config::Configuration running_;  // what is in force, but for what the loops' settings say
  std::filesystem::path folder_;
  std::vector<LoopRuntime>& loops_;
  const Historian& historian_;
  journal::Journal& journal_;
  ReloaderEnds ends_;
  std::uint32_t start_hash_;
  std::uint32_t files_hash_;
  reload::Plan plan_;                   // of the last good reload, as far as it has come
  std::vector<Offer> offers_;           // those that are not in force yet
  std::vector<std::uint32_t> offered_;  // number of the newest offer to each loop
  std::string refused_;
  std::uint32_t hash_before_ = 0;
  std::shared_ptr<Job> job_;            // the one that is being carried out
  std::shared_ptr<ReadFiles> reading_;  // null: no files are being read
  std::optional<std::vector<protocol::Diagnostic>> warnings_;
  std::chrono::steady_clock::time_point taking_since_{};
  bool slow_reported_ = false;
  DiskErrand reader_{"lw-reload"};

  std::atomic<std::uint32_t> config_hash_;
  mutable std::mutex mutex_;  // for what follows
  std::deque<std::shared_ptr<Job>> jobs_;
  std::uint64_t newest_ = 0;
  protocol::ConfigurationStatus status_;
};

}  // namespace loopwarden::daemon
