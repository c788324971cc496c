// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/corrective_action.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/alarm/limits.hpp"
#include "model/numeric/root_sum_square.hpp"

namespace loopwarden::alarm {
namespace {

using Order = CorrectiveStep::Order;
using State = CorrectiveState;

static_assert(Limits::kBaseline <= Limits::kTrial);

}  // namespace

CorrectiveAction::CorrectiveAction(const CorrectiveSettings& settings) noexcept
    : settings_(settings), state_(settings.enabled ? State::waiting : State::off) {}

CorrectiveAction::Errors CorrectiveAction::newest_mean(std::size_t windows) const noexcept {
  Errors sum;
  for (std::size_t i = 1; i <= windows; ++i) {
    const Errors& e = newest_[(steady_ - i) % Limits::kTrial];
    sum.rms += e.rms;
    sum.mean += e.mean;
  }
  const auto n = static_cast<double>(windows);
  return {sum.rms / n, sum.mean / n};
}

CorrectiveStep::Order CorrectiveAction::order_of(State state) const noexcept {
  if (acts(state)) return Order::on;
  return state == State::in_shadow ? Order::shadow : Order::back;
}

CorrectiveStep CorrectiveAction::go(CorrectiveState to, const char* why) noexcept {
  CorrectiveStep step{.form = settings_.form, .why = why, .from = state_, .to = to};
  if (order_of(to) != order_of(state_)) step.order = order_of(to);
  state_ = to;
  steady_ = 0;
  shadow_s_ = 0.0;
  return step;
}

CorrectiveStep CorrectiveAction::begin() noexcept {
  settling_ = 0;
  if (settings_.on_order && !ordered_)
    return go(State::offered, "the valve sticks, with known s and j");
  return go(State::in_shadow, may_act_ ? "the valve sticks, with known s and j"
                                       : "the valve sticks; s is too uncertain to act");
}

CorrectiveStep CorrectiveAction::explained(bool may_act) noexcept {
  if (!planned() || state_ == State::off || state_ == State::given_up) return {};
  may_act_ = may_act;
  disengaged_ = 0;
  if (acting()) return {};  // by now they have better values of the valve
  due_ = true;
  if (state_ != State::in_shadow) return {};
  CorrectiveStep step = begin();
  step.order = Order::shadow;
  return step;
}

CorrectiveStep CorrectiveAction::explained_otherwise() noexcept {
  if (!planned() || acting()) return {};
  due_ = ordered_ = false;
  if (state_ != State::offered && state_ != State::in_shadow) return {};
  return go(State::waiting, "the newest explanation is not stiction with valid s and j");
}

CorrectiveStep CorrectiveAction::ordered() noexcept {
  if (state_ != State::offered) return {};
  ordered_ = true;
  return begin();
}

CorrectiveStep CorrectiveAction::moves(const control::MovesState& state, double passed_s) noexcept {
  using control::DisengageReason;
  if (state_ == State::in_shadow && state.shadow) {
    shadow_s_ += passed_s;
    return shadow_s_ < Limits::kShadow_s ? CorrectiveStep{} : shadowed(state);
  }
  if (!calms() || state.shadow || state.phase != control::MovePhase::disengaged) return {};
  if (state.reason == DisengageReason::valve_follows) {
    due_ = ordered_ = false;
    return go(State::waiting, "the stem follows a probe: the valve does not stick");
  }
  if (state.latched || ++disengaged_ >= Limits::kMostDisengaged)
    return go(State::given_up, to_text(state.reason));
  due_ = true;  // the alarm is still on: try again, after a time in shadow
  return go(State::waiting, to_text(state.reason));
}

CorrectiveStep CorrectiveAction::shadowed(const control::MovesState& state) noexcept {
  if (state.latched) return go(State::given_up, to_text(state.reason));
  if (!(state.gain > 0.0) || steady_ < Limits::kLeastBaseline || !may_act_) return {};
  before_ = newest_mean(std::min(steady_, Limits::kBaseline));
  CorrectiveStep step = state.gain <= 1.0 - Limits::kLeastGain
                            ? go(State::trying, "planned moves reduce the error in shadow")
                            : go(State::given_up, "planned moves don't reduce the error in shadow");
  settling_ = Limits::kSettling;
  step.rms_before = before_.rms;
  step.mean_before = before_.mean;
  step.gain_in_shadow = state.gain;
  return step;
}

CorrectiveStep CorrectiveAction::window(const WindowMeasures& m, bool sticks, bool came) noexcept {
  if (state_ == State::off) return {};
  if (came && !planned()) {
    due_ = true;
    if (state_ == State::waiting) steady_ = 0;
  }
  if (!sticks) {
    due_ = ordered_ = false;
    const bool ends = state_ != State::waiting && state_ != State::vetoed;
    if (ends) return go(State::waiting, "the valve no longer sticks");
  }
  if (planned() && due_ && state_ == State::waiting) return begin();
  if (settling_ > 0) {
    --settling_;
    return {};
  }
  if (m.set_point_range_percent > Limits::kStandsStill_percent) return {};
  const double mean = std::abs(m.mean_error_percent);
  newest_[steady_ % Limits::kTrial] = {numeric::root_sum_square(m.variability_percent, mean), mean};
  ++steady_;
  return decide();
}

CorrectiveStep CorrectiveAction::decide() noexcept {
  if (!planned() && state_ == State::waiting && due_ && steady_ >= Limits::kBaseline) {
    before_ = newest_mean(Limits::kBaseline);
    due_ = false;
    CorrectiveStep step = go(State::trying, "the valve sticks");
    settling_ = Limits::kSettling;
    step.rms_before = before_.rms;
    step.mean_before = before_.mean;
    return step;
  }
  if (!acting() || steady_ < Limits::kTrial) return {};
  const Errors after = newest_mean(Limits::kTrial);
  const bool falls = after.rms <= (1.0 - Limits::kLeastGain) * before_.rms;
  const bool centred =
      planned() || after.mean <= std::max(before_.mean, settings_.allowed_mean_error_percent);
  CorrectiveStep step;
  if (!falls) {
    step = go(State::given_up, "the error did not fall");
  } else if (!centred) {
    step = go(State::given_up, "the mean error grew");
  } else if (state_ == State::trying) {
    step = go(State::helping, "the error fell");
  } else {
    steady_ = 0;
    return {};
  }
  step.rms_before = before_.rms;
  step.rms_after = after.rms;
  step.mean_before = before_.mean;
  step.mean_after = after.mean;
  return step;
}

CorrectiveStep CorrectiveAction::interrupted(bool controlling) noexcept {
  steady_ = 0;
  settling_ = 0;
  if (!acting() && state_ != State::in_shadow) return {};
  if (controlling) {  // saturated, or a gap: stay, and restart the trial
    settling_ = acting() ? Limits::kSettling : 0;
    return {};
  }
  due_ = true;  // the alarm is still on: try again, with a new baseline
  return go(State::waiting, "the loop is not in automatic with a good PV");
}

CorrectiveStep CorrectiveAction::refused() noexcept {
  if (!acting() && state_ != State::in_shadow) return {};
  settling_ = 0;
  CorrectiveStep step = go(State::given_up, "the loop refused the command");
  // The jacket was not changed. Planned moves in shadow would stay there for good.
  if (!planned()) step.order = Order::none;
  return step;
}

CorrectiveStep CorrectiveAction::reloaded() noexcept {
  if (!acting() && state_ != State::in_shadow) return {};
  due_ = true;  // the alarm is still on: try again, with a new baseline
  settling_ = 0;
  return go(State::waiting, "a reload has reset the loop");
}

CorrectiveStep CorrectiveAction::veto(Veto veto) noexcept {
  if (state_ == State::off || veto == veto_) return {};
  const Veto before = std::exchange(veto_, veto);
  // The operator may have set the jacket to act.
  const bool left_as_it_is = !planned() && before == Veto::hands_off;
  CorrectiveStep step;
  if (veto == Veto::none) {
    if (!planned()) due_ = true;  // a valve that still sticks is due
    step = go(State::waiting, before == Veto::commissioning ? "the commissioning has ended"
                                                            : "the operator's veto is lifted");
  } else {
    if (!planned()) due_ = false;
    step = go(State::vetoed, veto == Veto::commissioning ? "the loop is being commissioned"
                                                         : "the operator's veto");
  }
  ordered_ = false;
  settling_ = 0;
  if (left_as_it_is) step.order = Order::back;
  if (veto == Veto::hands_off && !planned()) step.order = Order::none;
  return step;
}

}  // namespace loopwarden::alarm
