// SPDX-License-Identifier: Apache-2.0
// Stores the newest windows of one loop with the result of every specialist, to show how an alarm
// was judged. Single precision is sufficient for display.
//
// A restart clears the log; the evidence of an alarm contains its window.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/monitor/window_builder.hpp"
#include "model/monitor/window_judge.hpp"

namespace loopwarden::daemon::supervision {

struct LoggedWindow {
  std::int64_t utc_ms = 0;  // end of the window
  // Reason why the window was not judged, or valid. Only valid and not_enough_movement were judged.
  monitor::WindowState state = monitor::WindowState::valid;
  monitor::WindowJudgement::Result result = monitor::WindowJudgement::Result::no_fault;
  monitor::AlarmKind fault = monitor::AlarmKind::unknown;
  float severity_percent = 0.0F;                               // % of the CO span
  std::array<float, monitor::kValveAlarmCount> probability{};  // as in WindowJudgement
  std::array<float, specialist::kConditions> errors{};         // (% of the CO span)^2
};

class WindowLog {
 public:
  static constexpr std::size_t kKept = 32;

  void add(std::int64_t utc_ms, monitor::WindowState state,
           const monitor::WindowJudgement& judgement);

  // Returns the windows, the oldest first.
  std::vector<LoggedWindow> windows() const;

 private:
  std::vector<LoggedWindow> ring_;
  std::size_t next_ = 0;
};

}  // namespace loopwarden::daemon::supervision
