// SPDX-License-Identifier: Apache-2.0
// Reads the daemon's files on a separate thread (lw-reload), because the disk may hang. For the
// main thread only.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "base/blocking/blocking_worker.hpp"

namespace loopwarden::daemon {

struct ReadFiles {
  config::Loaded<config::Configuration> files;
  std::string error;  // why the files could not be read at all
};

class ConfigurationFiles {
 public:
  explicit ConfigurationFiles(std::filesystem::path folder);
  void start() { reader_.start(); }
  void stop() { reader_.stop(); }
  // Does the same as stop(), but waits for the disk for at most `patience`. Returns false if it
  // hangs.
  bool stop_for(std::chrono::milliseconds patience) { return reader_.stop_for(patience); }

  // Starts reading. Returns false if the thread has not finished its last read: try again.
  bool begin();
  bool reading() const noexcept { return now_ != nullptr; }
  // Returns the files when they are read; null until then. Logs once if the disk is slow.
  std::shared_ptr<const ReadFiles> fetch();
  // Discards the read that is in progress.
  void forget() noexcept { now_ = nullptr; }

 private:
  // The result of the read, written by the thread.
  struct Reading : ReadFiles {
    std::atomic<bool> there{false};
  };
  std::filesystem::path folder_;
  std::shared_ptr<Reading> now_;  // null: no read is in progress
  bool slow_reported_ = false;
  base::BlockingWorker reader_{"lw-reload"};
};

}  // namespace loopwarden::daemon
