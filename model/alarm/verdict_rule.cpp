// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/verdict_rule.hpp"

#include <algorithm>

namespace loopwarden::alarm {

VerdictRule::VerdictRule(const VerdictRuleSettings& settings) noexcept : settings_(settings) {
  VerdictRuleSettings& s = settings_;
  s.windows = std::clamp<std::size_t>(s.windows, 1, kMostVotes);
  s.windows_on = std::clamp<std::size_t>(s.windows_on, 1, s.windows);
  s.windows_off = std::min(s.windows_off, s.windows_on - 1);
  s.windows_to_go = std::clamp(s.windows_to_go, s.windows, kMostVotes);
  s.probability_on = std::clamp(s.probability_on, 0.0, 1.0);
  s.probability_off = std::clamp(s.probability_off, 0.0, s.probability_on);
}

const AlarmConditions& VerdictRule::add(const WindowJudgement& judgement) noexcept {
  using Result = WindowJudgement::Result;
  if (judgement.result == Result::not_enough_movement) return conditions_;
  Vote& newest = history_[next_];
  next_ = (next_ + 1) % kMostVotes;
  votes_ = std::min(votes_ + 1, kMostVotes);
  for (std::size_t k = 0; k < kValveAlarmCount; ++k) {
    const bool named = judgement.result == Result::fault && index_of(judgement.fault) == k;
    newest.names[k] = named && judgement.probability[k] >= settings_.probability_on;
    newest.keeps[k] = judgement.probability[k] >= settings_.probability_off;
  }
  newest.severity_percent = judgement.severity_percent;
  for (std::size_t k = 0; k < kValveAlarmCount; ++k) {
    std::size_t names = 0;
    std::size_t keeps = 0;
    for (std::size_t i = 0; i < std::min(votes_, settings_.windows_to_go); ++i) {
      names += vote(i).names[k] && i < settings_.windows ? 1U : 0U;
      keeps += vote(i).keeps[k] ? 1U : 0U;
    }
    AlarmCondition& condition = conditions_[k];
    if (!condition.on) {
      condition.on = names >= settings_.windows_on;
    } else if (votes_ >= settings_.windows_to_go && keeps <= settings_.windows_off) {
      condition = {};
      continue;
    }
    if (condition.on) settle_severity(k);
  }
  return conditions_;
}

void VerdictRule::settle_severity(std::size_t kind) noexcept {
  std::array<double, kMostVotes> sizes{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < std::min(votes_, settings_.windows_to_go); ++i) {
    if (vote(i).names[kind]) sizes[count++] = vote(i).severity_percent;
  }
  if (count < settings_.windows_on) return;
  std::sort(sizes.begin(), sizes.begin() + count);
  conditions_[kind].severity_percent = 0.5 * (sizes[(count - 1) / 2] + sizes[count / 2]);
}

void VerdictRule::restore(AlarmKind kind, bool on, double severity_percent) noexcept {
  conditions_[index_of(kind)] = {on, on ? severity_percent : 0.0};
}

}  // namespace loopwarden::alarm
