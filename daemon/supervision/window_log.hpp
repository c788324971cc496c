// SPDX-License-Identifier: Apache-2.0
// The newest windows of one loop, each with what every specialist makes of it: what the judgement
// of an alarm is seen to come from. In single precision, which is enough to be looked at.
//
// What it can't do: survive a restart; the evidence of an alarm keeps its window.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/watch/window_builder.hpp"
#include "model/alarm/window_judge.hpp"

namespace loopwarden::daemon::supervision {

struct LoggedWindow {
  std::int64_t utc_ms = 0;  // end of the window
  // Reason why the window was not judged, or valid. Only valid and not_enough_movement were judged.
  alarm::WindowState state = alarm::WindowState::valid;
  alarm::WindowJudgement::Result result = alarm::WindowJudgement::Result::no_fault;
  alarm::AlarmKind fault = alarm::AlarmKind::unknown;
  float severity_percent = 0.0F;                             // % of the CO span
  std::array<float, alarm::kValveAlarmCount> probability{};  // as in WindowJudgement
  std::array<float, specialist::kConditions> errors{};       // (% of the CO span)^2
};

class WindowLog {
 public:
  static constexpr std::size_t kKept = 32;

  void add(std::int64_t utc_ms, alarm::WindowState state, const alarm::WindowJudgement& judgement);

  // Oldest first.
  std::vector<LoggedWindow> windows() const;

 private:
  std::vector<LoggedWindow> ring_;
  std::size_t next_ = 0;
};

}  // namespace loopwarden::daemon::supervision
