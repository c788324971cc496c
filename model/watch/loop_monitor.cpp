// SPDX-License-Identifier: Apache-2.0
#include "model/watch/loop_monitor.hpp"

#include <algorithm>
#include <limits>

#include "model/watch/limits.hpp"

namespace loopwarden::watch {

void LoopMonitor::restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept {
  if (kind == alarm::AlarmKind::model_gap) {
    if (twin_) twin_->restore(on);
    return;
  }
  told_[index_of(kind)].on = on;
  // Without specialists, only routine evidence can clear the condition.
  if (judge_ == nullptr && routine_) {
    routine_->restore(kind, on, severity_percent);
  } else {
    rule_.restore(kind, on, severity_percent);
  }
}

std::optional<LoadOutside> LoopMonitor::load_outside() const noexcept {
  return load_ ? load_->outside() : std::nullopt;
}

std::optional<TwinRemarks> LoopMonitor::remarks() const noexcept {
  if (!twin_) return std::nullopt;
  TwinRemarks out;
  out.judging = !twin_->inside()        ? Judging::outside
                : !twin_->judged_here() ? Judging::settling
                                        : Judging::here;
  if (!twin_on()) out.load = load_outside();
  for (std::size_t i = 0; i < kTwinChanges; ++i) {
    const auto change = static_cast<TwinChange>(i);
    out.untested[i] = {twin_->untested_s(change), twin_->tested(change)};
  }
  if (controller_ && controller_->watched()) {
    out.controller = Untested{controller_->untested_s(), controller_->tested()};
  }
  return out;
}

alarm::AlarmConditions LoopMonitor::conditions() noexcept {
  alarm::AlarmConditions all = rule_.conditions();
  const bool named = std::any_of(all.begin(), all.end(), [](const auto& c) { return c.on; });
  if (routine_ && !named) all = routine_->conditions();
  if (calm_) all = told_;
  // To the specialists, a load outside of their training looks like a valve fault.
  if (twin_quiet() && twin_->judged_here() && load_outside()) {
    for (std::size_t i = 0; i < all.size(); ++i) all[i].on = all[i].on && told_[i].on;
  }
  if (twin_) all[index_of(alarm::AlarmKind::model_gap)].on = twin_on();
  told_ = all;
  return all;
}

MonitorStep LoopMonitor::add(const Cycle& cycle) {
  MonitorStep step = judge_windows(cycle);
  if (routine_) {
    if (step.kind == MonitorStep::Kind::judged) routine_->specialists(step.judgement);
    if (routine_->add(cycle)) step.routine = routine_->judgement();
  }
  if (twin_) step.twin = watch_twin(cycle);
  if (step.kind == MonitorStep::Kind::judged || step.routine || step.twin) {
    step.conditions = conditions();
  }
  return step;
}

// In manual the plant may be under repair, and after a longer gap the course of CO is unknown.
bool LoopMonitor::watch_twin(const Cycle& cycle) noexcept {
  const bool was = twin_on();
  const bool near = cycle.period_index >= next_period_ &&
                    cycle.period_index - next_period_ <= Limits::kMostMissed;
  if (!cycle.automatic || !near) twin_->restart();
  if (controller_ && (!cycle.automatic || next_period_ != cycle.period_index)) {
    controller_->restart();
  }
  // CO of a missing cycle is the last one, because no other value was written.
  for (; cycle.automatic && near && next_period_ < cycle.period_index; ++next_period_) {
    twin_->add(std::numeric_limits<double>::quiet_NaN(), last_co_);
  }
  next_period_ = cycle.period_index + 1;
  last_co_ = cycle.co;
  if (cycle.automatic) {
    const double pv = cycle.pv_good ? cycle.pv : std::numeric_limits<double>::quiet_NaN();
    twin_->add(pv, cycle.co);
    if (controller_) controller_->add(cycle.sp, pv, cycle.co);
    load_->add(twin_->load_known() ? twin_->load() : std::numeric_limits<double>::quiet_NaN());
  }
  return twin_on() != was;
}

MonitorStep LoopMonitor::judge_windows(const Cycle& cycle) {
  MonitorStep step;
  const WindowBuilder::Progress progress = builder_.add(cycle);
  step.state = builder_.state();
  if (progress == WindowBuilder::Progress::none) return step;
  if (progress == WindowBuilder::Progress::broken) {
    step.kind = MonitorStep::Kind::interrupted;
    if (step.state == alarm::WindowState::not_automatic) rule_.restart();
    return step;
  }
  const alarm::Window window = builder_.window();
  step.kind = MonitorStep::Kind::not_fit;
  step.measures = measure(window);
  if (step.measures.saturated_percent > Limits::kMostSaturated) {
    step.state = alarm::WindowState::saturated;
    return step;
  }
  if (judge_ == nullptr) {
    step.state = alarm::WindowState::no_judge;
    return step;
  }
  step.judgement = judge_->judge(window);
  if (!calm_) rule_.add(step.judgement);
  if (step.judgement.result == alarm::WindowJudgement::Result::not_enough_movement && !calm_) {
    step.state = alarm::WindowState::not_enough_movement;
    return step;
  }
  step.kind = MonitorStep::Kind::judged;
  return step;
}

}  // namespace loopwarden::watch
