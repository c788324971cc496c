// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/loop_monitor.hpp"

namespace loopwarden::monitor {

MonitorStep LoopMonitor::add(const Cycle& cycle) {
  MonitorStep step;
  const WindowBuilder::Event event = builder_.add(cycle);
  step.state = builder_.state();
  if (event == WindowBuilder::Event::none) return step;
  if (event == WindowBuilder::Event::broken) {
    step.kind = MonitorStep::Kind::interrupted;
    if (step.state == WindowState::not_automatic) rule_.restart();
    return step;
  }
  const Window window = builder_.window();
  step.kind = MonitorStep::Kind::not_fit;
  step.measures = measure(window);
  if (step.measures.saturated_percent > kMostSaturated) {
    step.state = WindowState::saturated;
    return step;
  }
  if (judge_ == nullptr) {
    step.state = WindowState::no_judge;
    return step;
  }
  step.judgement = judge_->judge(window);
  step.conditions = rule_.add(step.judgement);
  if (step.judgement.result == WindowJudgement::Result::not_enough_movement) {
    step.state = WindowState::not_enough_movement;
    return step;
  }
  step.kind = MonitorStep::Kind::judged;
  return step;
}

}  // namespace loopwarden::monitor
