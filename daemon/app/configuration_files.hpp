// SPDX-License-Identifier: Apache-2.0
// Reads the daemon's files on a thread of its own (lw-reload): the disk may hang. Used by the main thread.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "base/errand/disk_errand.hpp"

namespace loopwarden::daemon {

struct ReadFiles {
  config::Loaded<config::Configuration> files;
  std::string error;  // why they could not be read at all
};

class ConfigurationFiles {
 public:
  explicit ConfigurationFiles(std::filesystem::path folder);
  void start() { reader_.start(); }
  void stop() { reader_.stop(); }
  // As stop(), but waits for the disk for at most `patience`; false if it hangs.
  bool stop_for(std::chrono::milliseconds patience) { return reader_.stop_for(patience); }

  // False: the thread is about to finish what it read last; try again.
  bool begin();
  bool reading() const noexcept { return now_ != nullptr; }
  // What begin() asked for, once it is there; null until then. Says once in the log that the disk is slow.
  std::shared_ptr<const ReadFiles> fetch();
  // What is being read is not wanted any more.
  void forget() noexcept { now_ = nullptr; }

 private:
  // What the errand fills in.
  struct Reading : ReadFiles {
    std::atomic<bool> there{false};
  };
  std::filesystem::path folder_;
  std::shared_ptr<Reading> now_;  // null: no files are being read
  bool slow_reported_ = false;
  base::DiskErrand reader_{"lw-reload"};
};

}  // namespace loopwarden::daemon
