// SPDX-License-Identifier: Apache-2.0
// The state of the daemon on this box: one thread asks the daemon, for all clients together.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "base/thread.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "daemon/protocol/overview.hpp"
#include "services/page/boxes/box_state.hpp"
#include "services/page/boxes/sparklines.hpp"
#include "services/net/http/event_hub.hpp"

namespace loopwarden::page {

struct BoxSettings {
  std::string status_socket;              // empty: there is no daemon, only the task
  std::chrono::milliseconds live{500};    // between two readings while clients listen
  std::chrono::milliseconds quiet{2000};  // without listeners, for sparklines
  std::chrono::milliseconds patience{1000};
};

class Box {
 public:
  // Called by the box's thread with an event for the clients.
  using Publish = std::function<void(http::EventKind kind, std::string data)>;
  // Called by the box's thread at each reading, at most every `quiet`.
  using Task = std::function<void()>;

  explicit Box(BoxSettings settings);
  Box(const Box&) = delete;
  Box& operator=(const Box&) = delete;
  ~Box() { stop(); }

  void start(Publish publish, Task task);
  void stop();
  void listeners(std::size_t count);  // a new listener is served at once

  // Any thread.
  struct Now {
    bool up = false;
    std::int64_t since_ms = 0;  // UTC, of the last change
    std::string why;            // reason, if it is down
    // Null: never received. The last one if the daemon is down.
    std::shared_ptr<const BoxState> state;
    std::shared_ptr<const std::string> alarms;           // as /api/alarms
    std::int64_t now_ms = 0;                             // of the newest overview
    std::shared_ptr<const std::vector<double>> periods;  // of each loop in that overview
  };
  Now now() const;
  std::string sparklines() const;

 private:
  void run();
  void look();
  void look_at(const std::string& overview);
  void fetch_state();
  void fetch_alarms();
  void went_down(const std::string& why);
  void came_up();
  void publish_state(const Now& now) const;
  void wait();

  BoxSettings settings_;
  protocol::DaemonClient daemon_;
  Publish publish_;
  Task task_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool quit_ = false;
  bool hurry_ = false;
  std::size_t listeners_ = 0;
  Now now_;
  Sparklines sparklines_;

  // Used only by the thread. alarm_columns_: of the newest overview; they change with the alarms.
  std::vector<double> alarm_columns_;
  std::string alarm_list_;  // as published last
  std::chrono::steady_clock::time_point alarms_due_{};
  base::Thread thread_;
};

// Returns the alarms to show: all that are neither normal nor suppressed and off. "first_out" marks
// the alarm that was raised before all other active alarms of its loop.
nlohmann::json alarms_for_page(const protocol::Alarms& all);

}  // namespace loopwarden::page
