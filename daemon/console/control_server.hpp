// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/console/access.hpp"
#include "daemon/console/operator_commands.hpp"
#include "daemon/console/readings.hpp"
#include "base/blocking/blocking_worker.hpp"
#include "base/local_server.hpp"
#include "base/repeated_attempt.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

// Serves the sockets that accept commands, on one thread: control.sock for all requests, page.sock
// and edge.sock for the requests that loopwardend.yaml allows there. One JSON object per line;
// docs/reference/sockets.md lists the requests.
class ControlServer {
 public:
  // Listens on the sockets in `folder` at once; start() begins to serve. A socket that can't be
  // opened is tried again until it can. Throws std::runtime_error if another daemon listens at
  // control.sock, because both would move the same valves.
  ControlServer(std::filesystem::path folder, const console::Plant& plant,
                const console::Archive& archive, const console::DaemonInfo& info,
                console::Operations& operations, const console::Rights& rights);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer() { stop(); }

  // Writes the metrics to `file` every 5 s. Call before start().
  void keep_metrics(std::filesystem::path file) { metrics_file_ = std::move(file); }
  void start();
  void stop();
  // As stop(), but waits at most `patience` for the disk. Returns false if it does not answer.
  bool stop_for(std::chrono::milliseconds patience);
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

  // Any thread. Applies to the next request; the next round opens and closes the sockets.
  void set_rights(const console::Rights& rights);
  console::Rights rights() const;
  // Returns the reason for each needed socket that is not open. From any thread.
  std::vector<std::string> problems() const;

  // Returns the answer to one request line; public for tests.
  base::LocalServer::Answer answer(std::string_view line, console::SocketName socket,
                                   unsigned peer_uid);

 private:
  std::filesystem::path path_of(console::SocketName socket) const;
  void listen(console::SocketName socket);
  void open_and_close();
  void round();
  void check_allowed(const std::string& request, console::SocketName socket);
  void publish_metrics();
  void end_thread() noexcept;

  std::filesystem::path folder_;
  console::Plant plant_;
  const console::DaemonInfo& info_;
  console::Readings readings_;
  console::OperatorCommands commands_;
  mutable std::mutex rights_mutex_;
  console::Rights rights_;
  std::optional<unsigned> page_group_;
  std::optional<unsigned> edge_group_;
  base::LocalServer server_;
  std::array<base::RepeatedAttempt, 3> opening_{base::RepeatedAttempt("control.sock"),
                                                base::RepeatedAttempt("page.sock"),
                                                base::RepeatedAttempt("edge.sock")};
  std::uint64_t not_allowed_ = 0;  // requests since the last line in the log
  std::chrono::steady_clock::time_point log_again_{};

  std::filesystem::path metrics_file_;
  std::chrono::steady_clock::time_point metrics_due_{};
  base::BlockingWorker metrics_{"lw-metrics"};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
