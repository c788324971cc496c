// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "daemon/console/readings.hpp"
#include "base/local_server.hpp"
#include "base/repeated_attempt.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

// Serves status.sock on a separate thread, so that many readers do not delay an operator.
class StatusServer {
 public:
  // Listens on the socket in `folder` at once; start() begins to serve. A socket that can't be
  // opened is tried again until it can.
  StatusServer(const std::filesystem::path& folder, const console::Plant& plant,
               const console::Archive& archive, const console::DaemonInfo& info);
  StatusServer(const StatusServer&) = delete;
  StatusServer& operator=(const StatusServer&) = delete;
  ~StatusServer() { stop(); }

  void start();
  void stop();
  // As stop(), but waits at most `patience` for the disk. Returns false if it does not answer.
  bool stop_for(std::chrono::milliseconds patience);
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

  // Returns why the socket is not open; empty: it is. From any thread.
  std::string problem() const { return opening_.problem(); }

  // Returns the answer to one request line; public for tests.
  std::string answer(std::string_view line);

 private:
  void open();
  void end_thread() noexcept;

  std::string path_;
  console::Readings readings_;
  base::RepeatedAttempt opening_{"status.sock"};
  base::LocalServer server_;
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
