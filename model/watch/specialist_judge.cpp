// SPDX-License-Identifier: Apache-2.0
#include "model/watch/specialist_judge.hpp"

namespace loopwarden::watch {

alarm::WindowJudgement judgement_of(const specialist::WindowVerdict& verdict) noexcept {
  using Result = alarm::WindowJudgement::Result;
  using specialist::Condition;
  alarm::WindowJudgement result;
  const auto p = [&](Condition c) { return verdict.probabilities[static_cast<std::size_t>(c)]; };
  result.probability = {p(Condition::stiction), p(Condition::backlash), p(Condition::hysteresis),
                        p(Condition::low_air_supply), p(Condition::other)};
  result.severity_percent = verdict.severity_percent;
  result.errors = verdict.mse;
  switch (verdict.verdict) {
    case specialist::VerdictName::no_fault: result.result = Result::no_fault; break;
    case specialist::VerdictName::not_enough_movement:
      result.result = Result::not_enough_movement;
      break;
    case specialist::VerdictName::stiction: result.fault = alarm::AlarmKind::stiction; break;
    case specialist::VerdictName::backlash: result.fault = alarm::AlarmKind::backlash; break;
    case specialist::VerdictName::hysteresis: result.fault = alarm::AlarmKind::hysteresis; break;
    case specialist::VerdictName::low_air_supply:
      result.fault = alarm::AlarmKind::low_air_supply;
      break;
    case specialist::VerdictName::unknown: result.fault = alarm::AlarmKind::unknown; break;
  }
  if (specialist::names_fault(verdict.verdict) ||
      verdict.verdict == specialist::VerdictName::unknown) {
    result.result = Result::fault;
  }
  return result;
}

alarm::WindowJudgement SpecialistJudge::judge(const alarm::Window& window) noexcept {
  return judgement_of(judge_.judge(window));
}

}  // namespace loopwarden::watch
