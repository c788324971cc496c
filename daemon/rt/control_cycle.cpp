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
  take_commands();

  // Newest sample with its age and quality.
  read(time);
  const hal::Sample pv = checked_pv();

  // Mode: the loop runs, or a fault decides the action of the output.
  const Conditions found = conditions(pv, missed, stop);
  Decision decision = supervisor_.step(found);
  find_output(found, decision);
  decision = supervisor_.settle(decision, output_.valid());
  const double output_before = controller_.output_applied();

  // PID, jacket, compensator, limits.
  const ControllerOutput out = decide(decision, pv);

  // A result that is not finite or out of range is not written.
  write(time, checked(out, decision, output_before));
  report_stop(out, decision);

  record(time, pv, out, missed);
  report(pv, missed);
}

ControlCycle::ControlCycle(std::uint32_t loop, double period_s, const LoopSettings& settings,
                           const StartSettings& start, ValvePositionSource valve_source,
                           effects::EffectChain valve_model, hal::LoopIo& io,
                           LoopChannels& channels, base::SpscRing<Event>& events)
    : loop_(loop),
      settings_(settings),
      configured_(settings),
      valve_source_(valve_source),
      valve_model_(std::move(valve_model)),
      io_(io),
      channels_(channels),
      events_(events),
      pv_guard_(settings.pv_check),
      supervisor_(settings.safety, period_s),
      controller_(settings.controller, period_s, start.set_point, settings.controller.output.low),
      output_(start.output) {
  controller_.request_mode(start.mode);
  publish_availability();
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
  // The action of a fault ends under the settings under which it began.
  const Fault fault = supervisor_.fault();
  const bool acts =
      fault != Fault::none && fault != Fault::starting && fault != Fault::output_unknown;
  if (!fresh && acts) return;
  if (!can_take_over(offer_.settings.controller.output, settings_.controller.output,
                     output_.valid(), controller_.output_commanded())) {
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
  if (jacket_since_offer_ && (*jacket_since_offer_ != JacketMode::on || settings_.jacket_may_act)) {
    apply(*jacket_since_offer_);
  }
  publish_in_force();
  channels_.settings_waiting.store(0, std::memory_order_relaxed);
  channels_.settings_taken.store(offer_.number, std::memory_order_release);
  event(EventCode::settings_applied, 0, 0, 0.0);
}

void ControlCycle::publish_in_force() noexcept { channels_.in_force.publish(configured_); }

// The last one decides: a Modbus master overrides the monitor, an operator overrides both.
void ControlCycle::take_commands() noexcept {
  answer(channels_.monitor_commands);
  answer(channels_.master_commands);
  answer(channels_.operator_commands);
}

void ControlCycle::answer(CommandMailbox& box) noexcept {
  Command command;
  while (box.commands.try_pop(command)) {
    const InForce now = in_force();
    const Refusal refusal = take(command, now);
    publish_availability();  // before the answer: the sender's next command depends on it
    box.answers.try_push({command.number, refusal, now});
  }
}

// Checks the command again: an earlier command of this cycle, a fault or a reload may have changed
// the loop since the command was accepted.
Refusal ControlCycle::take(const Command& command, const InForce& now) noexcept {
  Refusal refusal = judge(command.expected, now, settings_);
  if (refusal == Refusal::none)
    refusal = judge(command, availability(), settings_, configured_.controller.jacket.form);
  // A reload may have configured another corrective action than that of the command.
  if (refusal == Refusal::none && command.moves && *command.moves != MovesMode::off &&
      configured_.controller.compensator.kind != control::CompensatorKind::none) {
    refusal = Refusal::compensator_of_file;
  }
  if (refusal == Refusal::none && command.moves && *command.moves != MovesMode::off &&
      !control::gain_fits(channels_.moves_settings.newest().gain,
                          settings_.controller.pid.action)) {
    refusal = Refusal::moves_of_other_sign;
  }
  if (refusal == Refusal::none) {
    apply(command);
  } else {
    channels_.orders_refused.fetch_add(1, std::memory_order_relaxed);
    event(EventCode::command_refused, static_cast<std::uint8_t>(refusal), 0, 0.0);
  }
  return refusal;
}

void ControlCycle::apply(const Command& command) noexcept {
  if (command.jacket) {
    apply(*command.jacket);
    jacket_since_offer_ = command.jacket;
  }
  if (command.moves) apply(*command.moves);
  if (command.kp || command.ki || command.kd) {
    set_gains(command, settings_.controller.pid.gains);
    set_gains(command, configured_.controller.pid.gains);
    set_gains(command, offer_.settings.controller.pid.gains);  // also in an offer that waits
    controller_.configure(settings_.controller);
    publish_in_force();
  }
  // A command for an output ends the withholding of commands.
  if (command.output) channels_.withheld_until_ns.store(0, std::memory_order_relaxed);
  if (command.mode) controller_.request_mode(*command.mode);
  if (command.set_point) controller_.request_set_point(*command.set_point);
  if (command.output) {
    if (output_.report()) assume_output(*command.output);
    controller_.request_output(*command.output);
  }
}

void ControlCycle::apply(JacketMode mode) noexcept {
  control::JacketSettings& jacket = settings_.controller.jacket;
  jacket.form =
      mode == JacketMode::off ? control::JacketForm::off : configured_.controller.jacket.form;
  jacket.shadow = mode != JacketMode::on;
  controller_.configure(settings_.controller);
}

void ControlCycle::apply(MovesMode mode) noexcept {
  control::CompensatorSettings& compensator = settings_.controller.compensator;
  compensator = configured_.controller.compensator;
  if (mode != MovesMode::off) {
    compensator = {.kind = control::CompensatorKind::planned_moves,
                   .shadow = mode == MovesMode::shadow,
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

LoopAvailability ControlCycle::availability() const noexcept {
  // While the position is unknown, an operator may set it: no other source may ever give it. Graver
  // faults have an action and end without it.
  const Fault fault = supervisor_.fault();
  const bool waits = fault == Fault::starting || fault == Fault::output_unknown;
  const bool may_set = !output_.valid() && (waits || fault == Fault::output_lost);
  return {.mode = controller_.requested_mode(),
          .output_known = output_.valid(),
          .output_in_fault = fault != Fault::none && !may_set,
          .manual_after_fault = fault != Fault::none && !waits &&
                                settings_.safety.recovery == control::Recovery::manual};
}

void ControlCycle::publish_availability() noexcept {
  channels_.set_point_wanted.store(controller_.set_point_target(), std::memory_order_relaxed);
  channels_.output_wanted.store(
      output_.valid() ? controller_.manual_output() : std::numeric_limits<double>::quiet_NaN(),
      std::memory_order_relaxed);
  channels_.availability.store(packed(availability()), std::memory_order_release);
}

void ControlCycle::read(const hal::CycleTime& time) noexcept {
  io_.read(time, inputs_);
  inputs_.valve_position =
      checked_as_output(inputs_.valve_position, settings_.pv_check, settings_.controller.pid);
}

hal::Sample ControlCycle::checked_pv() noexcept {
  const control::OutputLimits& limits = settings_.controller.output;
  return pv_guard_.check(inputs_.process_variable,
                         {.value = controller_.output_applied(),
                          .span = limits.high - limits.low,
                          .automatic = controller_.mode() == Mode::automatic},
                         now_ns_);
}

control::Conditions ControlCycle::conditions(const hal::Sample& pv, std::uint64_t missed,
                                             bool stop) const noexcept {
  // A frozen PV is a fault only if the file has `frozen_after`.
  const bool bearable = pv.reason == hal::Reason::frozen && !settings_.pv_check.frozen_acts;
  const bool good =
      pv.quality == hal::Quality::good ||
      (pv.quality == hal::Quality::uncertain && (settings_.safety.uncertain_is_good || bearable));
  // In manual the operator needs no PV and keeps the valve if the transmitter fails.
  const bool needed = controller_.requested_mode() == Mode::automatic;
  return {.stop = stop,
          .enable_open = inputs_.enable == hal::Enable::open,
          .not_finite = output_.result_rejected(),
          .late_cycle = missed > settings_.safety.late_cycle_periods,
          // No command can be lost before the first one.
          .output_lost = !inputs_.output_ok && inputs_.output_reason != hal::Reason::never_received,
          .pv_good = good || !needed};
}

bool ControlCycle::read_back_good() const noexcept {
  const hal::Sample& position = inputs_.valve_position;
  const double age_s = static_cast<double>(now_ns_ - position.time_ns) * 1e-9;
  return inputs_.valve_position_fitted && position.quality == hal::Quality::good &&
         std::isfinite(position.value) && age_s <= settings_.pv_check.max_age_s;
}

void ControlCycle::find_output(const Conditions& found, const Decision& decision) noexcept {
  const bool withhold = !found.stop && controller_.requested_mode() == Mode::manual &&
                        now_ns_ < channels_.withheld_until_ns.load(std::memory_order_relaxed);
  const std::optional<double> position =
      output_.update({.now_ns = now_ns_,
                      .fault = decision.fault,
                      .action = decision.action,
                      .output_lost = found.output_lost,
                      .late_cycle = found.late_cycle,
                      .started = supervisor_.started(),
                      .withhold = withhold,
                      .read_back = {.fitted = inputs_.valve_position_fitted,
                                    .good = read_back_good(),
                                    .value = inputs_.valve_position.value,
                                    .time_ns = inputs_.valve_position.time_ns},
                      .max_age_s = settings_.pv_check.max_age_s});
  if (position) assume_output(*position);
}

void ControlCycle::assume_output(double output) noexcept {
  const double assumed = controller_.output_applied();
  controller_.assume_output(output);
  pv_guard_.output_learned(controller_.output_applied() - assumed);
}

double ControlCycle::known_output() const noexcept {
  return output_.valid() ? controller_.output_applied() : std::numeric_limits<double>::quiet_NaN();
}

ControllerOutput ControlCycle::decide(const Decision& decision, const hal::Sample& pv) noexcept {
  if (decision.to_manual) controller_.request_mode(Mode::manual);
  if (decision.fault != Fault::none) {
    // An output that an operator sets while the output is lost overrides the action of the fault.
    const bool as_reported = output_.reported() && decision.fault == Fault::output_lost;
    return controller_.step_fallback(as_reported ? control::OutputAction::hold() : decision.action);
  }

  control::ControllerInputs in{.process_variable = pv.value,
                               .process_variable_valid = pv.quality != hal::Quality::bad,
                               .read_back = inputs_.valve_position.value,
                               .read_back_valid = read_back_good(),
                               .moves = channels_.moves_requests.newest()};
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
  // An output that returns from outside the limits at the rate limit may still be outside, but
  // never farther than before.
  const control::OutputLimits& limits = settings_.controller.output;
  const double low = std::min(limits.low, output_before);
  const double high = std::max(limits.high, output_before);
  const bool rejected = !(out.output >= low && out.output <= high);
  output_.set_result_rejected(rejected);
  if (rejected) {
    controller_.assume_output(output_before);
    event(EventCode::result_not_finite, 0, 0, out.calculated);
  }

  return {
      .output = rejected ? output_before : out.output,
      .time_ns = now_ns_,
      // The first command starts the watchdog of the device; from then on every cycle writes.
      .write = output_.valid() && (decision.fault != Fault::starting || output_.command_written()),
      .alarm = decision.fault != Fault::none};
}

void ControlCycle::write(const hal::CycleTime& time, const hal::Command& command) noexcept {
  const double applied = io_.write(time, command);
  if (command.write) {
    controller_.applied(applied);
    output_.set_command_written();
  }
  modelled_valve_ = valve_model_.step(controller_.output_applied(), 0.0);
}

void ControlCycle::report_stop(const ControllerOutput& out, const Decision& decision) noexcept {
  const bool holds = decision.action.kind == control::OutputAction::Kind::hold;
  if (decision.fault == Fault::stop && !out.rate_limited && (output_.valid() || holds)) {
    channels_.stop_reached.store(true, std::memory_order_release);
  }
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
      .calculated = static_cast<float>(output_.valid() ? out.calculated : kNone),
      .jacket_rate = static_cast<float>(out.jacket_rate),
      .jacket_rate_shadow = static_cast<float>(out.jacket_shadow_rate),
      .compensator = static_cast<float>(out.correction),
      .compensator_shadow = static_cast<float>(out.correction_shadow),
      .mode = out.mode,
      .fault = supervisor_.fault(),
      .pv_quality = pv.quality,
      .pv_reason = pv.reason,
      .flags = static_cast<std::uint8_t>(
          flag(output_.valid() && out.at_low, record::kAtLow) |
          flag(output_.valid() && out.at_high, record::kAtHigh) |
          flag(output_.valid() && out.rate_limited, record::kRateLimited) |
          flag(missed > 0, record::kLateCycle) | flag(out.jacket_rate != 0.0, record::kJacketActs) |
          flag(out.correction != 0.0, record::kCompensatorActs) |
          flag(!inputs_.output_ok, record::kOutputLost) |
          flag(channels_.commissioned.load(std::memory_order_relaxed), record::kOutOfService)),
      .jacket_form = settings_.controller.jacket.form,
      .requested_mode = controller_.requested_mode(),
      .pv_limit = pv_limit,
      .age_ms = static_cast<float>(static_cast<double>(time.now_ns - pv.time_ns) / 1e6)};
  channels_.records.try_push(row);
  channels_.watched.try_push(row);
  channels_.position_age_ms.store(
      inputs_.valve_position.sequence > 0
          ? static_cast<float>(static_cast<double>(time.now_ns - inputs_.valve_position.time_ns) /
                               1e6)
          : -1.0F,
      std::memory_order_relaxed);
  send_moves_sample();
  publish_availability();
}

void ControlCycle::send_moves_sample() noexcept {
  const control::MovesSample* sample = controller_.moves_sample();
  if (sample != nullptr) channels_.moves_samples.try_push(*sample);
  channels_.moves_run.store(sample != nullptr, std::memory_order_release);
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
  const control::MoveHold* hold = controller_.compensator().hold();
  const control::DisengageReason reason = hold != nullptr && !hold->sample().shadow
                                              ? hold->disengaged()
                                              : control::DisengageReason::none;
  if (std::exchange(reported_disengaged_, reason) != reason &&
      reason != control::DisengageReason::none) {
    event(EventCode::moves_disengaged, static_cast<std::uint8_t>(reason), 0, 0.0);
  }
}

void ControlCycle::event(EventCode code, std::uint8_t a, std::uint8_t b, double value) noexcept {
  events_.try_push(
      {.time_ns = now_ns_, .loop = loop_, .code = code, .a = a, .b = b, .value = value});
}

}  // namespace loopwarden::daemon::rt
