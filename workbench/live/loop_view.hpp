// SPDX-License-Identifier: Apache-2.0
// The picture of one loop in a terminal: state line, trend of SP, PV, CO and stem.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "workbench/live/daemon_client.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench {

// The last samples of one loop, fetched piece by piece.
class TrendBuffer {
 public:
  explicit TrendBuffer(std::string loop) : loop_(std::move(loop)) {}

  // Fetches what is new. Throws std::runtime_error.
  void update(DaemonClient& daemon);
  const std::string& loop() const noexcept { return loop_; }
  const Trend& rows() const noexcept { return rows_; }

 private:
  static constexpr std::size_t kKept = 20000;
  std::string loop_;
  Trend rows_;
};

std::string daemon_line(const nlohmann::json& status);
// What does not reach the disk, and why; none: all does.
std::vector<std::string> disk_troubles(const nlohmann::json& status);
// The loop's alarms that are on, wait, or lie on the shelf, in words; empty: none.
std::string alarm_summary(const nlohmann::json& loop);
// Of the daemon's answer to `alarms`: what it means that some of those that are off can't come at present; empty where all can.
std::string suppressed_note(const nlohmann::json& answer);
// One line a loop; the selected one is marked.
std::vector<std::string> loop_table(const nlohmann::json& status, std::size_t selected);
// What the monitor says of the valve, the condition indices, and how record and bus do.
std::vector<std::string> loop_details(const nlohmann::json& loop);
// Its place in the status. Throws DaemonRefused, with the nearest tag, if there is none of that name.
std::size_t loop_index(const nlohmann::json& status, const std::string& name);
// The last `window_s` seconds in a frame of `columns` x `rows`: PV and SP above, CO and stem below.
std::vector<std::string> trend_view(const nlohmann::json& loop, const Trend& trend, double window_s,
                                    int columns, int rows);
// "value unit", or a dash where there is none.
std::string quantity(const nlohmann::json& value, const std::string& unit);

}  // namespace loopwarden::workbench
