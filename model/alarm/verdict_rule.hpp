// SPDX-License-Identifier: Apache-2.0
// From verdicts on windows to alarm conditions: N of M, with one threshold to come and another to go.
//
//   A window votes for fault k with p_k, its probability, where it names k, and with p_k against the
//   threshold to go wherever it could be judged.
//   off -> on   at least `windows_on` of the last `windows` judged named k with p_k >= probability_on
//   on  -> off  at most `windows_off` of the last `windows_to_go` judged have p_k >= probability_off
//
// The severity of a condition is the median over the windows that named it, of the last `windows_to_go` judged:
// one window's size is off by half at times, and an alarm's limits shall not follow it. With fewer than `windows_on`
// of them it stays.
//
// A window that can't tell (not_enough_movement) is no evidence: it changes nothing, and the windows before
// it keep their place. One odd window raises no alarm, and one quiet window ends none.
//
// windows_to_go is longer than windows in the daemon: a valve that sticks shows it only when the loop crosses
// the stick band, and looks healthy in between. Repair takes more windows to believe than a fault.
//
// Stepped by the caller, once a window. No clock, no allocation.
//
// Errors: settings outside their ranges are brought within them.
// What it can't do: weigh how long ago a window was.
//
// Source: N-of-M voting with hysteresis as in alarm practice, EEMUA 191 (2013), chapter 8.
#pragma once

#include <array>
#include <cstddef>

#include "model/alarm/loop_alarms.hpp"
#include "model/alarm/window_judge.hpp"

namespace loopwarden::alarm {

inline constexpr std::size_t kMostVotes = 16;

struct VerdictRuleSettings {
  std::size_t windows = 5;        // M, 1 to kMostVotes
  std::size_t windows_on = 3;     // N, 1 to M
  std::size_t windows_off = 1;    // below N
  std::size_t windows_to_go = 0;  // M to kMostVotes; 0: M
  double probability_on = 0.5;    // 0 to 1
  double probability_off = 0.3;   // at most probability_on

  friend bool operator==(const VerdictRuleSettings&, const VerdictRuleSettings&) = default;
};

// The daemon's, and of all that shows what the daemon would do: twelve minutes of windows without the fault.
inline constexpr VerdictRuleSettings kAlarmRule{.windows_to_go = 15};

class VerdictRule {
 public:
  explicit VerdictRule(const VerdictRuleSettings& settings = {}) noexcept;

  // The conditions after this window.
  const AlarmConditions& add(const WindowJudgement& judgement) noexcept;

  // Forgets the windows, not the conditions: after an interruption, or with other specialists.
  void restart() noexcept { votes_ = 0; }
  // A condition from before a restart of the program.
  void restore(AlarmKind kind, bool on, double severity_percent) noexcept;

  const AlarmConditions& conditions() const noexcept { return conditions_; }
  const VerdictRuleSettings& settings() const noexcept { return settings_; }

 private:
  struct Vote {
    std::array<bool, kValveAlarmCount> names{};
    std::array<bool, kValveAlarmCount> keeps{};
    double severity_percent = 0.0;  // % of the CO span, of the fault that it names
  };
  // The place of the newest but `age` in the history.
  const Vote& vote(std::size_t age) const noexcept {
    return history_[(next_ + kMostVotes - 1 - age) % kMostVotes];
  }
  void settle_severity(std::size_t kind) noexcept;

  VerdictRuleSettings settings_;
  std::array<Vote, kMostVotes> history_{};
  std::size_t next_ = 0;
  std::size_t votes_ = 0;  // in the history, at most kMostVotes
  AlarmConditions conditions_{};
};

}  // namespace loopwarden::alarm
