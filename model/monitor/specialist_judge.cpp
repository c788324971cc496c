// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/specialist_judge.hpp"

namespace loopwarden::monitor {

WindowJudgement judgement_of(const specialist::WindowVerdict& verdict) noexcept {
  using Result = WindowJudgement::Result;
  using specialist::Condition;
  WindowJudgement result;
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
    case specialist::VerdictName::stiction: result.fault = AlarmKind::stiction; break;
    case specialist::VerdictName::backlash: result.fault = AlarmKind::backlash; break;
    case specialist::VerdictName::hysteresis: result.fault = AlarmKind::hysteresis; break;
    case specialist::VerdictName::low_air_supply: result.fault = AlarmKind::low_air_supply; break;
    case specialist::VerdictName::unknown: result.fault = AlarmKind::unknown; break;
  }
  if (specialist::names_fault(verdict.verdict) ||
      verdict.verdict == specialist::VerdictName::unknown) {
    result.result = Result::fault;
  }
  return result;
}

WindowJudgement SpecialistJudge::judge(const Window& window) noexcept {
  return judgement_of(judge_.judge({window.pv, window.co}));
}

}  // namespace loopwarden::monitor
