// SPDX-License-Identifier: Apache-2.0
// Makes the team of specialists (model/specialist) a judge of the monitor.
#pragma once

#include "model/alarm/window_judge.hpp"
#include "model/specialist/judge/team.hpp"

namespace loopwarden::watch {

alarm::WindowJudgement judgement_of(const specialist::WindowVerdict& verdict) noexcept;

class SpecialistJudge final : public alarm::WindowJudge {
 public:
  // The team's LoopFacts describe the loop of the windows. Their period must be that of the
  // windows.
  explicit SpecialistJudge(const specialist::Team& team) : judge_(team) {}

  alarm::WindowJudgement judge(const alarm::Window& window) noexcept override;

 private:
  specialist::TeamJudge judge_;
};

}  // namespace loopwarden::watch
