// SPDX-License-Identifier: Apache-2.0
// Reports which files are in force and which changes wait. The main thread writes, any thread
// reads.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "daemon/app/reload.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon {

class ReloadStatus {
 public:
  explicit ReloadStatus(std::uint32_t start_hash);

  // Record that files were read and are being applied, or were refused. The next publish() shows
  // it.
  void taken(std::uint32_t files_hash);
  void refused(const std::string& why) { refused_ = why; }
  // `plan`: plan of the last accepted files, with its progress.
  void publish(const reload::Plan& plan);

  protocol::ConfigurationStatus get() const;
  // Returns the hash of the configuration in force. It matches no set of files while a change
  // waits.
  std::uint32_t config_hash() const noexcept { return config_hash_.load(); }

 private:
  std::uint32_t start_hash_;
  std::uint32_t files_hash_;
  std::string refused_;  // why the newest files were refused; empty: they were accepted
  std::atomic<std::uint32_t> config_hash_;
  mutable std::mutex mutex_;
  protocol::ConfigurationStatus status_;
};

}  // namespace loopwarden::daemon
