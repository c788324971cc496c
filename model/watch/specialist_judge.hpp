// SPDX-License-Identifier: Apache-2.0
// The team of specialists (model/specialist) as the judge that the monitor asks.
#pragma once

#include "model/alarm/window_judge.hpp"
#include "model/specialist/judge/team.hpp"

namespace loopwarden::watch {

alarm::WindowJudgement judgement_of(const specialist::WindowVerdict& verdict) noexcept;

class SpecialistJudge final : public alarm::WindowJudge {
 public:
  // The team's LoopFacts say what loop the windows come from; their period must be the window's.
  explicit SpecialistJudge(const specialist::Team& team) : judge_(team) {}

  alarm::WindowJudgement judge(const alarm::Window& window) noexcept override;

 private:
  specialist::TeamJudge judge_;
};

}  // namespace loopwarden::watch
