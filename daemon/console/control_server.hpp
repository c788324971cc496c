// SPDX-License-Identifier: Apache-2.0
// The sockets that give orders, on one thread: control.sock for all requests, page.sock and edge.sock for those that
// loopwardend.yaml allows there. One JSON object a line; README.md in this folder has the requests.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/console/offers.hpp"
#include "daemon/console/operator_orders.hpp"
#include "daemon/console/parts.hpp"
#include "daemon/console/readings.hpp"
#include "base/errand/disk_errand.hpp"
#include "base/local_server.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

class ControlServer {
 public:
  // Sockets in `folder`. Listens from now on, serves from start() on. Throws std::runtime_error.
  ControlServer(std::filesystem::path folder, console::Parts parts, const console::Rights& rights);
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ~ControlServer() { stop(); }

  // Every 5 s from the start on, before start() only.
  void keep_metrics(std::filesystem::path file) { metrics_file_ = std::move(file); }
  void start();
  void stop();
  // As stop(), but waits for the disk for at most `patience`; false if it hangs.
  bool stop_for(std::chrono::milliseconds patience);
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

  // Any thread. In force for the next request; sockets come and go with the next round.
  void set_rights(const console::Rights& rights);
  console::Rights rights() const;

  // The answer to one request line; public for tests.
  base::LocalServer::Answer answer(std::string_view line, console::SocketName socket,
                                   unsigned peer_uid);

 private:
  std::filesystem::path path_of(console::SocketName socket) const;
  void listen(console::SocketName socket);
  void follow_rights();
  void round();
  void check_allowed(const std::string& request, console::SocketName socket);
  void publish_metrics();
  void end_thread() noexcept;

  std::filesystem::path folder_;
  console::Parts parts_;
  console::Readings readings_{parts_, "lw-reader"};
  console::OperatorOrders orders_{parts_};
  mutable std::mutex rights_mutex_;
  console::Rights rights_;
  console::Rights followed_;  // the sockets are as these say
  std::optional<unsigned> page_group_;
  std::optional<unsigned> edge_group_;
  base::LocalServer server_;
  std::uint64_t not_allowed_ = 0;  // requests since the log had the last one
  std::chrono::steady_clock::time_point log_again_{};

  std::filesystem::path metrics_file_;
  std::chrono::steady_clock::time_point metrics_due_{};
  base::DiskErrand metrics_{"lw-metrics"};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
