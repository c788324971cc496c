// SPDX-License-Identifier: Apache-2.0
// Turns verdicts on windows into alarm conditions: N of M, with separate thresholds to raise and to
// clear.
//
//   A window votes for fault k with p_k, its probability, if it names k. Every window that could be
//   judged votes with p_k against the threshold to clear.
//   off -> on   at least `windows_on` of the last `windows` judged named k with p_k >=
//               probability_on
//   on  -> off  at most `windows_off` of the last `windows_to_go` judged have p_k >=
//               probability_off
//
// The severity of a condition is the median over the windows that named it, of the last
// `windows_to_go` judged. The size of a single window is sometimes wrong by half, and an alarm's
// limits must not follow it. With fewer than `windows_on` such windows the severity keeps its
// value.
//
// A window with too little movement (not_enough_movement) is no evidence: the rule ignores it, and
// the windows before it keep their place. One odd window raises no alarm, and one quiet window
// clears none.
//
// Stepped by the caller, once per window. No clock, no allocation.
//
// Errors: settings outside their ranges are set to the nearest limit.
// Limits: it can't weigh the age of a window.
//
// Source: N-of-M voting with hysteresis as in alarm practice, EEMUA 191 (2013), chapter 8.
#pragma once

#include <array>
#include <cstddef>

#include "model/alarm/limits.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/alarm/window_judge.hpp"

namespace loopwarden::alarm {

inline constexpr std::size_t kMostVotes = 16;

struct VerdictRuleSettings {
  std::size_t windows = Limits::kWindows;            // M, 1 to kMostVotes
  std::size_t windows_on = Limits::kWindowsOn;       // N, 1 to M
  std::size_t windows_off = Limits::kWindowsOff;     // below N
  std::size_t windows_to_go = 0;                     // M to kMostVotes; 0: M
  double probability_on = Limits::kProbabilityOn;    // 0 to 1
  double probability_off = Limits::kProbabilityOff;  // at most probability_on

  friend bool operator==(const VerdictRuleSettings&, const VerdictRuleSettings&) = default;
};

// The rule of the daemon, and of all commands that show its decisions.
inline constexpr VerdictRuleSettings kAlarmRule{.windows_to_go = Limits::kWindowsToClear};

class VerdictRule {
 public:
  explicit VerdictRule(const VerdictRuleSettings& settings = {}) noexcept;

  // Adds a window and returns the conditions after it.
  const AlarmConditions& add(const WindowJudgement& judgement) noexcept;

  // Forgets the windows but not the conditions: after an interruption, or with other specialists.
  void restart() noexcept { votes_ = 0; }
  // Restores a condition from before a restart of the program.
  void restore(AlarmKind kind, bool on, double severity_percent) noexcept;

  const AlarmConditions& conditions() const noexcept { return conditions_; }
  const VerdictRuleSettings& settings() const noexcept { return settings_; }

 private:
  struct Vote {
    std::array<bool, kValveAlarmCount> names{};
    std::array<bool, kValveAlarmCount> keeps{};
    double severity_percent = 0.0;  // % of the CO span, of the named fault
  };
  // Returns the vote with age `age`; the newest has age 0.
  const Vote& vote(std::size_t age) const noexcept {
    return history_[(next_ + kMostVotes - 1 - age) % kMostVotes];
  }
  void settle_severity(std::size_t kind) noexcept;

  VerdictRuleSettings settings_;
  std::array<Vote, kMostVotes> history_{};
  std::size_t next_ = 0;
  std::size_t votes_ = 0;  // number in the history, at most kMostVotes
  AlarmConditions conditions_{};
};

}  // namespace loopwarden::alarm
