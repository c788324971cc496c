// SPDX-License-Identifier: Apache-2.0
// The interface that decides which fault a window shows. The monitor depends only on this
// interface.
#pragma once

#include <array>
#include <cstdint>

#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/window.hpp"
#include "model/specialist/judge/classes.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

struct WindowJudgement {
  enum class Result : std::uint8_t { no_fault, fault, not_enough_movement };
  Result result = Result::no_fault;
  AlarmKind fault = AlarmKind::unknown;  // if the result is fault
  // Probability of each fault, 0 to 1. The remainder to a sum of 1 is the probability of no fault.
  std::array<double, kValveAlarmCount> probability{};
  double severity_percent = 0.0;  // % of the CO span, of the fault
  // Mean square error that remains after each specialist's explanation, (% of the CO span)^2, in
  // the order of specialist::Condition; 0 from a judge without specialists.
  std::array<double, specialist::kConditions> errors{};

  friend bool operator==(const WindowJudgement&, const WindowJudgement&) = default;
};

constexpr const char* to_text(WindowJudgement::Result result) noexcept {
  return numeric::enum_name<WindowJudgement::Result::not_enough_movement>(
      result, {"no_fault", "fault", "not_enough_movement"});
}

class WindowJudge {
 public:
  WindowJudge() = default;
  WindowJudge(const WindowJudge&) = delete;
  WindowJudge& operator=(const WindowJudge&) = delete;
  virtual ~WindowJudge() = default;

  // Judges a window of kWindowSamples samples. Neither allocates nor throws; used by one thread at
  // a time.
  virtual WindowJudgement judge(const Window& window) noexcept = 0;
};

}  // namespace loopwarden::alarm
