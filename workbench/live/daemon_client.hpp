// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/exit_code.hpp"
#include "base/local_socket.hpp"

namespace loopwarden::workbench {

// A stretch of one loop's trend; NaN where there was no value.
struct Trend {
  double sample_time_s = 0.0;
  std::vector<std::uint64_t> period;
  std::vector<double> sp, pv, co, stem;
};

// The daemon answers and does not do it: usage where a tag is unknown, data where it can't be done now.
class DaemonRefused : public std::runtime_error {
 public:
  DaemonRefused(ExitCode code, const std::string& what) : std::runtime_error(what), code_(code) {}
  ExitCode exit_code() const noexcept { return code_; }

 private:
  ExitCode code_;
};

class OrderNotTaken : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The daemon on this box. Every call throws DaemonRefused with the daemon's own words, or
// std::runtime_error if it can't be reached.
class DaemonClient {
 public:
  static constexpr const char* kDefaultSocket = "/run/loopwardend/control.sock";

  explicit DaemonClient(const std::string& socket_path) : client_(socket_path) {}

  nlohmann::json status();
  // Rows from period `from` on, as many as the daemon keeps.
  Trend trend(const std::string& loop, std::uint64_t from);
  // `request` without "request" and "loop", e.g. {"set_point", 5.0}. Comes back when the loop's cycle has taken
  // the order and it is in the journal on the disk, for which it waits no longer than `for_disk`; false: it is
  // not there yet. Throws DaemonRefused where the order can't act, OrderNotTaken where no cycle took it.
  bool set(const std::string& loop, nlohmann::json request,
           std::chrono::milliseconds for_disk = std::chrono::milliseconds(0));
  // The number that reload_state() wants.
  std::uint64_t reload(bool dry_run);
  // {"state": ...}; once that is "done", "outcome", "lines" and what belongs to them.
  nlohmann::json reload_state(std::uint64_t number);
  std::string start_record(const std::string& loop, const std::string& name);
  std::string stop_record(const std::string& loop);
  // {"now_ms": ..., "alarms": [...]}
  nlohmann::json alarms();
  // `order`: "alarm", "action" and what belongs to it. Returns {"alarm": ..., "on_disk": ...}.
  nlohmann::json act(const std::string& loop, nlohmann::json order);
  nlohmann::json explain(const std::string& loop, const std::string& alarm);
  nlohmann::json veto(const std::string& loop, bool veto, const std::string& reason);
  // Returns {"said": ..., "on_disk": ...}.
  nlohmann::json outcome(const std::string& loop, const std::string& found,
                         const std::string& note);
  // The newest lines, newest first; of every loop if `loop` is empty; with `text` anywhere in them.
  nlohmann::json journal(std::size_t most, const std::string& loop, const std::string& text = {});

 private:
  nlohmann::json ask(const nlohmann::json& request);
  base::LocalClient client_;
};

}  // namespace loopwarden::workbench
