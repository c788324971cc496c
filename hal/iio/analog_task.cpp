// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_task.hpp"

#include <algorithm>

namespace loopwarden::hal::iio {
namespace {

constexpr std::int64_t kShortestSliceNs = 1'000'000;
constexpr std::int64_t kLongestSliceNs = 20'000'000;
constexpr std::int64_t kSlicesPerPoll = 10;

}  // namespace

AnalogTask::AnalogTask(const AnalogSettings& settings, const std::string& name, GpioChips& chips,
                       const EventSink& sink)
    : poll_period_ns_(settings.poll_period_ns),
      max_command_age_ns_(max_command_age_ns(settings)),
      slice_ns_(
          std::clamp(settings.poll_period_ns / kSlicesPerPoll, kShortestSliceNs, kLongestSliceNs)),
      process_variable_(settings.iio_root, settings.process_variable, name + " input", sink),
      output_(settings.iio_root, settings.output, name + " output", sink),
      digital_(settings, name, chips, sink) {
  if (settings.read_back) {
    read_back_.emplace(settings.iio_root, *settings.read_back, name + " read-back", sink);
  }
}

void AnalogTask::open(std::int64_t now_ns) {
  digital_.open(now_ns);
  output_.connect(now_ns);
  next_poll_ns_ = now_ns;
  step(now_ns);
}

void AnalogTask::step(std::int64_t now_ns) {
  // A converter that hangs delays this thread, and with it the commands and the alive line.
  if (last_turn_ns_ && now_ns - *last_turn_ns_ > max_command_age_ns_) resumed_ns_ = now_ns;
  last_turn_ns_ = now_ns;
  serve_command(now_ns);
  // A watchdog relay on the alive line supplies the positioner, so the line is silent until there
  // is a command to follow. With a read-back it starts earlier, because the position sensor may
  // need that supply.
  const bool loop_alive =
      command_.id != 0 && !command_.parked && !withholding_ && (commanded_ || read_back_);
  // Before the inputs, which may take long, so that `now_ns` is correct for the lines.
  digital_.step(now_ns, loop_alive, command_.alarm);
  if (now_ns >= next_poll_ns_) {
    process_variable_.poll(now_ns);
    if (read_back_) read_back_->poll(now_ns);
    // A late turn keeps the phase of the polling.
    next_poll_ns_ += poll_period_ns_ * (1 + (now_ns - next_poll_ns_) / poll_period_ns_);
  }
  publish(now_ns);
  publish_counters();
}

std::int64_t AnalogTask::due_ns(std::int64_t now_ns) const noexcept {
  return std::min(next_poll_ns_, now_ns + slice_ns_);
}

void AnalogTask::serve_command(std::int64_t now_ns) {
  const bool fresh = commands.fetch(command_);
  commanded_ = commanded_ || command_.write;
  output_.connect(now_ns);
  withholding_ =
      command_.id != 0 && !command_.parked && now_ns - command_.time_ns > max_command_age_ns_;
  // Before the first command there is no output that could be withheld or lost.
  if (!commanded_) return;
  if (withholding_) {
    withhold(now_ns);
    return;
  }
  safe_put_ = false;
  if (command_.id != 0 && command_.time_ns < resumed_ns_) {
    // This command was decided before the loop knew that commands were withheld. The loss is
    // reported to the loop first.
    adrift_ = true;
    return;
  }
  // A refused command is not repeated, because the loop sends the next one soon.
  if (!fresh || !command_.write || !output_.put(command_.output, now_ns)) return;
  written_id_ = command_.id;
  adrift_ = false;
}

void AnalogTask::withhold(std::int64_t now_ns) {
  if (!adrift_) ++withheld_;
  adrift_ = true;
  if (safe_put_ || now_ns < safe_retry_ns_) return;
  safe_put_ = output_.put_safe(now_ns);
  safe_retry_ns_ = now_ns + poll_period_ns_;
}

void AnalogTask::publish(std::int64_t now_ns) noexcept {
  AnalogState fresh;
  fresh.inputs.process_variable = process_variable_.sample();
  fresh.inputs.valve_position_fitted = read_back_.has_value();
  if (read_back_) fresh.inputs.valve_position = read_back_->sample();
  fresh.inputs.enable = digital_.enable();
  fresh.inputs.output_ok = output_.ok() && !adrift_;
  fresh.inputs.output_reason = output_.ok() && adrift_ ? Reason::stale : output_.reason();
  fresh.stage_known = output_.stage().has_value();
  if (fresh.stage_known) fresh.stage = *output_.stage();
  fresh.written_id = written_id_;
  fresh.time_ns = now_ns;
  state.publish(fresh);
}

void AnalogTask::publish_counters() noexcept {
  ChannelCounters sum = process_variable_.counters();
  const auto add = [&sum](const ChannelCounters& more) {
    sum.transactions += more.transactions;
    sum.device_errors += more.device_errors;
    sum.garbage += more.garbage;
    sum.reconnects += more.reconnects;
  };
  if (read_back_) add(read_back_->counters());
  add(output_.counters());
  const auto set = [](auto& counter, auto value) {
    counter.store(value, std::memory_order_relaxed);
  };
  set(counters_.transactions, sum.transactions);
  set(counters_.device_exceptions, sum.device_errors);
  set(counters_.invalid_replies, sum.garbage);
  set(counters_.reconnects, sum.reconnects);
  set(counters_.writes, output_.writes());
  set(counters_.write_errors, output_.write_errors());
  set(counters_.old_commands_withheld, withheld_);
  set(counters_.connected, process_variable_.connected() && output_.connected());
}

IoCounters AnalogTask::counters() const noexcept {
  const auto get = [](const auto& counter) { return counter.load(std::memory_order_relaxed); };
  IoCounters counters;
  counters.transactions = get(counters_.transactions);
  counters.device_exceptions = get(counters_.device_exceptions);
  counters.invalid_replies = get(counters_.invalid_replies);
  counters.reconnects = get(counters_.reconnects);
  counters.writes = get(counters_.writes);
  counters.write_errors = get(counters_.write_errors);
  counters.old_commands_withheld = get(counters_.old_commands_withheld);
  counters.connected = get(counters_.connected);
  return counters;
}

}  // namespace loopwarden::hal::iio
