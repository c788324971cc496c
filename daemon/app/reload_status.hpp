// SPDX-License-Identifier: Apache-2.0
// Which files are in force, and what waits, for who asks: the main thread writes, any thread reads.
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

  // Files were read and are carried out as far as they go; files were refused. Both show with the next publish().
  void taken(std::uint32_t files_hash);
  void refused(const std::string& why) { refused_ = why; }
  // `plan`: of the last files that were taken, as far as it has come.
  void publish(const reload::Plan& plan);

  protocol::ConfigurationStatus get() const;
  // Of what is in force; of no set of files while something waits.
  std::uint32_t config_hash() const noexcept { return config_hash_.load(); }

 private:
  std::uint32_t start_hash_;
  std::uint32_t files_hash_;
  std::string refused_;  // why the newest files were refused; empty: they were not
  std::atomic<std::uint32_t> config_hash_;
  mutable std::mutex mutex_;
  protocol::ConfigurationStatus status_;
};

}  // namespace loopwarden::daemon
