// SPDX-License-Identifier: Apache-2.0
// The daemon's local face: answers `loopwarden top` and `loopwarden set` over a Unix socket, one JSON
// object a line. Requests:
//   {"request": "status"}
//   {"request": "trend", "loop": TAG, "from": PERIOD, "most": N}
//   {"request": "set", "loop": TAG, "set_point": X | "mode": "auto"|"man" | "output": X |
//                                  "jacket": "off"|"shadow"|"on"}: several of them take effect in one cycle,
//    mode first. Answers "order": N and "sample_time_s"; what can't act is refused (daemon/rt/order.hpp)
//   {"request": "order", "loop": TAG, "order": N}: "state": "waiting"|"done"|"refused", then "why" and "on_disk"
//   {"request": "record", "loop": TAG, "start": NAME | "stop": true}
//   {"request": "alarms"}
//   {"request": "alarm", "loop": TAG, "alarm": NAME, "action": "acknowledge"|"reset"|"shelve"|"unshelve",
//    "minutes": N, "reason": TEXT}
//   {"request": "veto", "loop": TAG, "veto": true|false, "reason": TEXT}
//   {"request": "explain", "loop": TAG, "alarm": NAME}
//   {"request": "journal", "most": N, "loop": TAG}
// Answers carry "ok": true, or "ok": false and "error".
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/recorder/disk_errand.hpp"
#include "daemon/evidence/evidence_store.hpp"
#include "daemon/recorder/historian.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/monitor/watch_board.hpp"
#include "daemon/orders/order_desk.hpp"
#include "hal/os/local_socket.hpp"
#include "hal/os/thread.hpp"

namespace loopwarden::daemon {

class ControlServer {
 public:
  // `daemon_status` gives the part of the status that is not about one loop.
  ControlServer(std::string socket_path, std::vector<LoopRuntime>& loops, Historian& historian,
                monitor::WatchBoard& board, journal::Journal& journal,
                const EvidenceStore& evidence, double severe_percent,
                std::function<nlohmann::json()> daemon_status);
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

  // The answer to one request line; public for tests.
  std::string answer(std::string_view line, unsigned peer_uid);

 private:
  nlohmann::json handle(const nlohmann::json& request, unsigned peer_uid);
  nlohmann::json status() const;
  nlohmann::json loop_status(std::size_t index) const;
  nlohmann::json trend(const nlohmann::json& request) const;
  nlohmann::json set(const nlohmann::json& request, unsigned peer_uid);
  nlohmann::json order(const nlohmann::json& request);
  nlohmann::json record(const nlohmann::json& request, unsigned peer_uid);
  nlohmann::json alarms() const;
  nlohmann::json alarm(const nlohmann::json& request, unsigned peer_uid);
  nlohmann::json veto(const nlohmann::json& request, unsigned peer_uid);
  nlohmann::json explain(const nlohmann::json& request);
  nlohmann::json journal(const nlohmann::json& request);
  std::size_t loop_index(const nlohmann::json& request) const;
  orders::OrderDesk& desk(std::size_t loop);
  void collect_answers();
  // Lines for the journal, without their results: of an operator's action, of each part of an order.
  journal::JournalEntry line_of(std::size_t loop, unsigned peer_uid) const;
  std::vector<journal::JournalEntry> lines_of(const rt::Order& order, std::size_t loop,
                                              unsigned peer_uid) const;

  std::vector<LoopRuntime>& loops_;
  Historian& historian_;
  monitor::WatchBoard& board_;
  journal::Journal& journal_;
  const EvidenceStore& evidence_;
  double severe_percent_;  // % of the CO span
  std::function<nlohmann::json()> daemon_status_;
  std::deque<orders::OrderDesk> desks_;  // one for each loop, from the first order on
  hal::os::LocalServer server_;
  void publish_metrics();
  void end_thread() noexcept;

  std::filesystem::path metrics_file_;
  std::chrono::steady_clock::time_point metrics_due_{};
  // The disk is theirs: a request that needs it waits for a second at most, all others not at all.
  DiskErrand reader_{"lw-reader"};
  DiskErrand metrics_{"lw-metrics"};
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  hal::os::Thread thread_;
};

}  // namespace loopwarden::daemon
