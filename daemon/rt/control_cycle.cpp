// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/control_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace loopwarden::daemon::rt {

using control::Conditions;
using control::ControllerOutput;
using control::Decision;
using control::Fault;
using control::Mode;

void ControlCycle::run(const hal::CycleTime& time, std::uint64_t missed, bool stop) noexcept {
  now_ns_ = time.now_ns;
  take_settings();
  take_orders();

  // Newest sample, its age and quality.
  io_.read(time, inputs_);
  inputs_.valve_position =
      checked_as_output(inputs_.valve_position, settings_.pv_check, settings_.controller.pid);
  const control::OutputLimits& limits = settings_.controller.output;
  const hal::Sample pv = pv_guard_.check(inputs_.process_variable,
                                         {.value = controller_.output_applied(),
                                          .span = limits.high - limits.low,
                                          .automatic = controller_.mode() == Mode::automatic},
                                         now_ns_);

  // Mode: may the loop run, and if not, what does the output do?
  const Conditions found = conditions(pv, missed, stop);
  Decision decision = supervisor_.step(found);
  withhold(stop);
  learn_output(found, decision);
  decision = supervisor_.settle(decision, output_known_);
  const double output_before = controller_.output_applied();

  // PID, jacket, compensator, limits.
  const ControllerOutput out = decide(decision, pv);

  // Finite and in range, or not written.
  const hal::Command command = checked(out, decision, output_before);
  const double applied = io_.write(time, command);
  if (command.write) controller_.applied(applied);
  modelled_valve_ = valve_model_.step(controller_.output_applied(), 0.0);
  ever_written_ = ever_written_ || command.write;
  const bool goes_nowhere = decision.action.kind == control::OutputAction::Kind::hold;
  if (decision.fault == Fault::stop && !out.rate_limited && (output_known_ || goes_nowhere)) {
    channels_.stop_reached.store(true, std::memory_order_release);
  }

  record(time, pv, out, missed);
  report(pv, missed);
}

ControlCycle::ControlCycle(std::uint32_t loop, double period_s, const LoopSettings& settings,
                           const StartSettings& start, ValvePositionSource valve_source,
                           plant::EffectChain valve_model, hal::LoopIo& io, LoopChannels& channels,
                           base::SpscRing<Event>& events)
    : loop_(loop),
      settings_(settings),
      configured_(settings),
      start_(start),
      valve_source_(valve_source),
      valve_model_(std::move(valve_model)),
      io_(io),
      channels_(channels),
      events_(events),
      pv_guard_(settings.pv_check),
      supervisor_(settings.safety, period_s),
      controller_(settings.controller, period_s, start.set_point, settings.controller.output.low) {
  controller_.request_mode(start.mode);
  publish_standing();
}

void ControlCycle::take_settings() noexcept {
  const bool fresh = channels_.settings.fetch(offer_);
  if (fresh) {
    jacket_since_offer_.reset();
    channels_.settings_seen.store(offer_.number, std::memory_order_release);
  }
  offer_waits_ = (offer_waits_ || fresh) && !offer_.withdrawn;
  if (!offer_waits_) {
    if (fresh) channels_.settings_waiting.store(0, std::memory_order_release);
    return;
  }
  // The settings must not change in the middle of a test.
  if (channels_.commissioned.load(std::memory_order_acquire)) {
    channels_.settings_waiting.store(offer_.number, std::memory_order_release);
    return;
  }
  // An action that began under the settings in force ends under them.
  const Fault fault = supervisor_.fault();
  const bool acts =
      fault != Fault::none && fault != Fault::starting && fault != Fault::output_unknown;
  if (!fresh && acts) return;
  if (!can_take_over(offer_.settings.controller.output, settings_.controller.output, output_known_,
                     controller_.output_commanded())) {
    if (!fresh) return;
    channels_.settings_waiting.store(offer_.number, std::memory_order_release);
    event(EventCode::settings_wait, 0, 0, known_output());
    return;
  }
  offer_waits_ = false;
  settings_ = configured_ = offer_.settings;
  controller_.configure(settings_.controller);
  supervisor_.configure(settings_.safety);
  pv_guard_.configure(settings_.pv_check);
  if (jacket_since_offer_ && (*jacket_since_offer_ != JacketWish::on || settings_.jacket_may_act)) {
    apply(*jacket_since_offer_);
  }
  publish_in_force();
  channels_.settings_waiting.store(0, std::memory_order_relaxed);
  channels_.settings_taken.store(offer_.number, std::memory_order_release);
  event(EventCode::settings_applied, 0, 0, 0.0);
}

void ControlCycle::publish_in_force() noexcept { channels_.in_force.publish(configured_); }

// Who is taken later has the last word: the monitor gives way to the Modbus master, the master to the operator.
void ControlCycle::take_orders() noexcept {
  answer(channels_.monitor_orders);
  answer(channels_.master_orders);
  answer(channels_.operator_orders);
}

void ControlCycle::answer(OrderBox& box) noexcept {
  Order order;
  while (box.orders.try_pop(order)) {
    const InForce now = in_force();
    const Refusal refusal = take(order, now);
    publish_standing();  // before the answer: who has it judges his next order by this one
    box.answers.try_push({order.number, refusal, now});
  }
}

// Judged when it was let in, and once more: what went before it in this cycle, a fault or a reload may
// have changed what it finds.
Refusal ControlCycle::take(const Order& order, const InForce& now) noexcept {
  Refusal refusal = judge(order.expected, now, settings_);
  if (refusal == Refusal::none)
    refusal = judge(order, standing(), settings_, configured_.controller.jacket.form);
  // After a reload the file may have another corrective action than the one that orders.
  if (refusal == Refusal::none && order.moves && *order.moves != MovesWish::off &&
      configured_.controller.compensator.kind != control::CompensatorKind::none) {
    refusal = Refusal::compensator_of_file;
  }
  if (refusal == Refusal::none && order.moves && *order.moves != MovesWish::off &&
      !control::gain_fits(channels_.moves_settings.newest().gain,
                          settings_.controller.pid.action)) {
    refusal = Refusal::moves_of_other_sign;
  }
  if (refusal == Refusal::none) {
    apply(order);
  } else {
    channels_.orders_refused.fetch_add(1, std::memory_order_relaxed);
    event(EventCode::order_refused, static_cast<std::uint8_t>(refusal), 0, 0.0);
  }
  return refusal;
}

void ControlCycle::apply(const Order& order) noexcept {
  if (order.jacket) {
    apply(*order.jacket);
    jacket_since_offer_ = order.jacket;
  }
  if (order.moves) apply(*order.moves);
  if (order.kp || order.ki || order.kd) {
    set_gains(order, settings_.controller.pid.gains);
    set_gains(order, configured_.controller.pid.gains);
    set_gains(order, offer_.settings.controller.pid.gains);  // it may wait: the order is newer
    controller_.configure(settings_.controller);
    publish_in_force();
  }
  // An order for an output ends the withholding of commands.
  if (order.output) channels_.withheld_until_ns.store(0, std::memory_order_relaxed);
  if (order.mode) controller_.request_mode(*order.mode);
  if (order.set_point) controller_.request_set_point(*order.set_point);
  if (order.output) {
    // His word tells where the output stands.
    if (!output_known_) {
      learn(*order.output);
      told_ = true;
    }
    controller_.request_output(*order.output);
  }
}

void ControlCycle::apply(JacketWish wish) noexcept {
  control::JacketSettings& jacket = settings_.controller.jacket;
  jacket.form =
      wish == JacketWish::off ? control::JacketForm::off : configured_.controller.jacket.form;
  jacket.shadow = wish != JacketWish::on;
  controller_.configure(settings_.controller);
}

void ControlCycle::apply(MovesWish wish) noexcept {
  control::CompensatorSettings& compensator = settings_.controller.compensator;
  compensator = configured_.controller.compensator;
  if (wish != MovesWish::off) {
    compensator = {.kind = control::CompensatorKind::planned_moves,
                   .shadow = wish == MovesWish::shadow,
                   .planned = channels_.moves_settings.newest()};
  }
  controller_.configure(settings_.controller);
}

InForce ControlCycle::in_force() const noexcept {
  const control::PidGains& gains = settings_.controller.pid.gains;
  return {.mode = controller_.requested_mode(),
          .set_point = controller_.set_point_target(),
          .output = known_output(),
          .kp = gains.kp,
          .ki = gains.ki,
          .kd = gains.kd};
}

Standing ControlCycle::standing() const noexcept {
  // Where nothing is known of the output, an order for it tells where it stands: nothing else may ever. Graver faults
  // than these have an action of their own, and end without it.
  const Fault fault = supervisor_.fault();
  const bool waits = fault == Fault::starting || fault == Fault::output_unknown;
  const bool tells = !output_known_ && (waits || fault == Fault::output_lost);
  return {.mode = controller_.requested_mode(),
          .output_known = output_known_,
          .output_in_fault = fault != Fault::none && !tells,
          .manual_after_fault = fault != Fault::none && !waits &&
                                settings_.safety.recovery == control::Recovery::manual};
}

void ControlCycle::publish_standing() noexcept {
  channels_.set_point_wanted.store(controller_.set_point_target(), std::memory_order_relaxed);
  channels_.output_wanted.store(
      output_known_ ? controller_.manual_output() : std::numeric_limits<double>::quiet_NaN(),
      std::memory_order_relaxed);
  channels_.standing.store(packed(standing()), std::memory_order_release);
}

control::Conditions ControlCycle::conditions(const hal::Sample& pv, std::uint64_t missed,
                                             bool stop) const noexcept {
  // A frozen PV moves no valve unless the loop's file has `frozen_after`.
  const bool bearable = pv.reason == hal::Reason::frozen && !settings_.pv_check.frozen_acts;
  const bool good =
      pv.quality == hal::Quality::good ||
      (pv.quality == hal::Quality::uncertain && (settings_.safety.uncertain_is_good || bearable));
  // In manual the operator needs no PV: a dead transmitter does not take the valve out of his hands.
  const bool needed = controller_.requested_mode() == Mode::automatic;
  return {.stop = stop,
          .enable_open = inputs_.enable == hal::Enable::open,
          .not_finite = was_not_finite_,
          .late_cycle = missed > settings_.safety.late_cycle_periods,
          // Before the first command there is nothing that could have been lost.
          .output_lost = !inputs_.output_ok && inputs_.output_reason != hal::Reason::never_received,
          .pv_good = good || !needed};
}

bool ControlCycle::read_back_good() const noexcept {
  const hal::Sample& position = inputs_.valve_position;
  const double age_s = static_cast<double>(now_ns_ - position.time_ns) * 1e-9;
  return inputs_.valve_position_fitted && position.quality == hal::Quality::good &&
         std::isfinite(position.value) && age_s <= settings_.pv_check.max_age_s;
}

// While no command goes out the device may move the valve: where the output stands is not known,
// and the loop asks for nothing to be written. Then it goes on as after a loss. A stop action is
// never withheld.
void ControlCycle::withhold(bool stop) noexcept {
  const bool withheld = !stop && controller_.requested_mode() == Mode::manual &&
                        now_ns_ < channels_.withheld_until_ns.load(std::memory_order_relaxed);
  if (withheld) {
    if (!withheld_) known_before_withheld_ = output_known_;
    output_known_ = told_ = false;
    unknown_since_ns_ = now_ns_;
  } else if (withheld_ && !inputs_.valve_position_fitted) {
    output_known_ = output_known_ || known_before_withheld_;
  }
  withheld_ = withheld;
}

// After commands did not reach the valve, or the process was stopped, the device's own watchdog may
// have moved it. The loop then writes nothing until a read-back taken since then, or the operator,
// tells where it stands, and goes on from there. The same at start, where anybody may move the valve
// until the first command. Without a read-back it goes on from what it last asked for. A stop action
// does not wait for it.
void ControlCycle::learn_output(const Conditions& found, const Decision& decision) noexcept {
  const bool fitted = inputs_.valve_position_fitted;
  const bool starting = decision.fault == Fault::starting && !ever_written_;
  const bool lost = found.output_lost || found.late_cycle;
  // A fault goes on for a while after its cause: what is told in it counts until the cause comes back.
  const bool in_doubt =
      lost || decision.fault == Fault::output_lost || decision.fault == Fault::late_cycle;
  if (found.late_cycle || (lost && !was_lost_)) {
    unknown_since_ns_ = now_ns_;
    told_ = false;
  }
  was_lost_ = lost;
  if ((in_doubt || starting) && fitted && !told_) output_known_ = false;
  if (output_known_ || withheld_) return;
  using Kind = control::OutputAction::Kind;
  const double unknown_s = static_cast<double>(now_ns_ - unknown_since_ns_) * 1e-9;
  if (read_back_good() && inputs_.valve_position.time_ns >= unknown_since_ns_) {
    learn(inputs_.valve_position.value);
  } else if (decision.fault == Fault::stop && decision.action.kind == Kind::value) {
    // A ramp would begin at a guess. A read-back is given its time to tell first.
    if (!fitted || unknown_s > settings_.pv_check.max_age_s) learn(decision.action.value);
  } else if (!ever_known_ && supervisor_.started() && start_.output.kind == Kind::value) {
    learn(start_.output.value);
  }
}

void ControlCycle::learn(double output) noexcept {
  const double believed = controller_.output_applied();
  controller_.assume_output(output);
  pv_guard_.output_learned(controller_.output_applied() - believed);
  output_known_ = ever_known_ = true;
}

double ControlCycle::known_output() const noexcept {
  return output_known_ ? controller_.output_applied() : std::numeric_limits<double>::quiet_NaN();
}

ControllerOutput ControlCycle::decide(const Decision& decision, const hal::Sample& pv) noexcept {
  if (decision.to_manual) controller_.request_mode(Mode::manual);
  if (decision.fault != Fault::none) {
    // Who tells the output while it is lost wants it there, and not where the action would take it.
    const bool as_told = told_ && decision.fault == Fault::output_lost;
    return controller_.step_fallback(as_told ? control::OutputAction::hold() : decision.action);
  }

  control::ControllerInputs in{.process_variable = pv.value,
                               .process_variable_valid = pv.quality != hal::Quality::bad,
                               .read_back = inputs_.valve_position.value,
                               .read_back_valid = read_back_good()};
  if (valve_source_ == ValvePositionSource::read_back) {
    in.valve_position = inputs_.valve_position.value;
    in.valve_position_valid = read_back_good();
  } else if (valve_source_ == ValvePositionSource::model) {
    in.valve_position = modelled_valve_;
    in.valve_position_valid = true;
  }
  return controller_.step(in);
}

hal::Command ControlCycle::checked(const ControllerOutput& out, const Decision& decision,
                                   double output_before) noexcept {
  // An output on its way back from outside the limits, at the rate limit, may still be beyond them,
  // but never farther than it was.
  const control::OutputLimits& limits = settings_.controller.output;
  const double low = std::min(limits.low, output_before);
  const double high = std::max(limits.high, output_before);
  was_not_finite_ = !(out.output >= low && out.output <= high);
  if (was_not_finite_) {
    controller_.assume_output(output_before);
    event(EventCode::result_not_finite, 0, 0, out.calculated);
  }

  return {.output = was_not_finite_ ? output_before : out.output,
          .time_ns = now_ns_,
          // A watchdog that the first command armed is fed from then on, whatever comes.
          .write = output_known_ && (decision.fault != Fault::starting || ever_written_),
          .alarm = decision.fault != Fault::none};
}

void ControlCycle::record(const hal::CycleTime& time, const hal::Sample& pv,
                          const ControllerOutput& out, std::uint64_t missed) noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto flag = [](bool set, unsigned bit) { return set ? bit : 0U; };
  const bool stem_known =
      inputs_.valve_position_fitted && inputs_.valve_position.quality != hal::Quality::bad;
  const hal::Limit pv_limit = pv.quality == hal::Quality::bad ? hal::Limit::none : pv.limit;
  const record::RecordRow row{
      .time_ns = time.now_ns,
      .period_index = time.period_index,
      .sp = out.set_point,
      .pv = pv.quality == hal::Quality::bad ? kNone : pv.value,
      .co = known_output(),
      .stem = stem_known ? inputs_.valve_position.value : kNone,
      .calculated = static_cast<float>(output_known_ ? out.calculated : kNone),
      .jacket_rate = static_cast<float>(out.jacket_rate),
      .jacket_rate_shadow = static_cast<float>(out.jacket_shadow_rate),
      .compensator = static_cast<float>(out.correction),
      .compensator_shadow = static_cast<float>(out.correction_shadow),
      .mode = static_cast<std::uint8_t>(out.mode),
      .fault = static_cast<std::uint8_t>(supervisor_.fault()),
      .pv_quality = static_cast<std::uint8_t>(pv.quality),
      .pv_reason = static_cast<std::uint8_t>(pv.reason),
      .flags = static_cast<std::uint8_t>(
          flag(output_known_ && out.at_low, record::kAtLow) |
          flag(output_known_ && out.at_high, record::kAtHigh) |
          flag(output_known_ && out.rate_limited, record::kRateLimited) |
          flag(missed > 0, record::kLateCycle) | flag(out.jacket_rate != 0.0, record::kJacketActs) |
          flag(out.correction != 0.0, record::kCompensatorActs) |
          flag(!inputs_.output_ok, record::kOutputLost) |
          flag(channels_.commissioned.load(std::memory_order_relaxed), record::kOutOfService)),
      .jacket_form = static_cast<std::uint8_t>(settings_.controller.jacket.form),
      .requested_mode = static_cast<std::uint8_t>(controller_.requested_mode()),
      .pv_limit = static_cast<std::uint8_t>(pv_limit),
      .age_ms = static_cast<float>(static_cast<double>(time.now_ns - pv.time_ns) / 1e6)};
  channels_.records.try_push(row);
  channels_.watched.try_push(row);
  channels_.position_age_ms.store(
      inputs_.valve_position.sequence > 0
          ? static_cast<float>(static_cast<double>(time.now_ns - inputs_.valve_position.time_ns) /
                               1e6)
          : -1.0F,
      std::memory_order_relaxed);
  const control::PlannedMoves* moves = controller_.compensator().planned_moves();
  // Nothing steps them in another mode.
  if (moves != nullptr && controller_.mode() == Mode::automatic) {
    channels_.moves.publish(moves->state());
  } else {
    channels_.moves.none();
  }
  publish_standing();
}

void ControlCycle::report(const hal::Sample& pv, std::uint64_t missed) noexcept {
  if (missed > 0) {
    event(EventCode::cycle_missed, static_cast<std::uint8_t>(std::min<std::uint64_t>(missed, 255)),
          0, 0.0);
  }
  if (supervisor_.fault() != reported_fault_) {
    reported_fault_ = supervisor_.fault();
    event(EventCode::fault_changed, static_cast<std::uint8_t>(reported_fault_),
          static_cast<std::uint8_t>(pv.reason), known_output());
  }
  if (controller_.mode() != reported_mode_) {
    reported_mode_ = controller_.mode();
    event(EventCode::mode_changed, static_cast<std::uint8_t>(reported_mode_), 0, known_output());
  }
  if (controller_.jacket().standing_back() != reported_standing_back_) {
    reported_standing_back_ = controller_.jacket().standing_back();
    event(reported_standing_back_ ? EventCode::jacket_stands_back : EventCode::jacket_resumes, 0, 0,
          controller_.jacket().mean_error());
  }
  const control::PlannedMoves* moves = controller_.compensator().planned_moves();
  const control::MovesState state = moves != nullptr ? moves->state() : control::MovesState{};
  const bool disengaged = state.phase == control::MovePhase::disengaged && !state.shadow;
  if (std::exchange(reported_disengaged_, disengaged) != disengaged && disengaged)
    event(EventCode::moves_disengaged, static_cast<std::uint8_t>(state.reason), 0, 0.0);
}

void ControlCycle::event(EventCode code, std::uint8_t a, std::uint8_t b, double value) noexcept {
  events_.try_push(
      {.time_ns = now_ns_, .loop = loop_, .code = code, .a = a, .b = b, .value = value});
}

}  // namespace loopwarden::daemon::rt
