// SPDX-License-Identifier: Apache-2.0
// status.sock, on a thread of its own: whoever reads, and however much, makes no operator wait.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "daemon/console/parts.hpp"
#include "daemon/console/readings.hpp"
#include "base/local_server.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

class StatusServer {
 public:
  // The socket in `folder`. Listens from now on, serves from start() on. Throws std::runtime_error.
  StatusServer(const std::filesystem::path& folder, console::Parts parts);
  StatusServer(const StatusServer&) = delete;
  StatusServer& operator=(const StatusServer&) = delete;
  ~StatusServer() { stop(); }

  void start();
  void stop();
  // As stop(), but waits for the disk for at most `patience`; false if it hangs.
  bool stop_for(std::chrono::milliseconds patience);
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

  // The answer to one request line; public for tests.
  std::string answer(std::string_view line);

 private:
  void end_thread() noexcept;

  console::Parts parts_;
  console::Readings readings_{parts_, "lw-reader-2"};
  base::LocalServer server_;
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
