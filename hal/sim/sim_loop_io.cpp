// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/sim_loop_io.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopwarden::hal::sim {
namespace {
// Limits the samples to be simulated after a long pause, for example of a stopped process.
constexpr std::uint64_t kMostSamplesPerRead = 1000;

// The simulated transmitter stops at the ends of its range, up to its last step.
Limit limit_of(double value, const plant::TransmitterParameters& range) noexcept {
  if (value - range.low < 0.5 * range.resolution || value <= range.low) return Limit::low;
  if (range.high - value < 0.5 * range.resolution || value >= range.high) return Limit::high;
  return Limit::none;
}
}  // namespace

SimLoopIo::SimLoopIo(const SimSettings& settings)
    : plant_(settings.model, settings.model.scenario.seed),
      transmitter_(settings.model.transmitter),
      io_faults_(settings.io_faults),
      output_low_(settings.model.controller.pid.output_low),
      output_high_(settings.model.controller.pid.output_high),
      output_resolution_(settings.output_resolution),
      held_output_(output_low_) {
  if (!settings.model.scenario.set_point.empty()) {
    held_output_ = plant_.output_for(settings.model.scenario.set_point.front().second);
    plant_.reset(held_output_);
  }
}

bool SimLoopIo::drive(double output, std::chrono::milliseconds, std::string&) {
  held_output_ = std::clamp(output, output_low_, output_high_);
  return true;
}

bool SimLoopIo::active(IoFault::Kind kind) const noexcept {
  const double now_s = plant_.time_s();
  return std::any_of(io_faults_.begin(), io_faults_.end(), [&](const IoFault& fault) {
    return fault.kind == kind && now_s >= fault.from_s && now_s < fault.to_s;
  });
}

void SimLoopIo::read(const CycleTime& time, Inputs& inputs) noexcept {
  if (!first_read_) {
    const std::uint64_t passed = std::min(time.period_index - last_period_, kMostSamplesPerRead);
    for (std::uint64_t i = 0; i < passed; ++i) plant_.step(held_output_);
  }
  first_read_ = false;
  last_period_ = time.period_index;

  const bool link_lost = active(IoFault::Kind::link_lost);
  if (!link_lost) {
    const double value = active(IoFault::Kind::frozen) ? pv_.value : plant_.process_variable();
    pv_ = {.value = value,
           .time_ns = time.now_ns,
           .sequence = pv_.sequence + 1,
           .quality = Quality::good,
           .reason = Reason::none,
           .limit = limit_of(value, transmitter_)};
    if (active(IoFault::Kind::not_a_number)) pv_.value = std::numeric_limits<double>::quiet_NaN();
    if (active(IoFault::Kind::dead_sensor)) {
      pv_.quality = Quality::bad;
      pv_.reason = Reason::sensor_failure;
      pv_.limit = Limit::none;
    }
    stem_ = {.value = plant_.stem(),
             .time_ns = time.now_ns,
             .sequence = stem_.sequence + 1,
             .quality = Quality::good,
             .reason = Reason::none,
             .limit = Limit::none};
  }
  inputs.process_variable = pv_;
  inputs.valve_position = stem_;
  inputs.valve_position_fitted = true;
  inputs.output_ok = !link_lost && !active(IoFault::Kind::output_lost);
  inputs.output_reason = inputs.output_ok ? Reason::none : Reason::link_lost;
  inputs.enable = active(IoFault::Kind::enable_open) ? Enable::open : Enable::not_fitted;

  truth_.publish({.time_s = plant_.time_s(),
                  .stem = plant_.stem(),
                  .process_variable = plant_.true_process_variable(),
                  .fault_severity = plant_.fault_severity()});
}

double SimLoopIo::write(const CycleTime&, const Command& command) noexcept {
  if (!command.write) return held_output_;
  double output = std::clamp(command.output, output_low_, output_high_);
  if (output_resolution_ > 0.0) {
    output = output_low_ +
             output_resolution_ * std::nearbyint((output - output_low_) / output_resolution_);
  }
  const bool reaches = !active(IoFault::Kind::link_lost) && !active(IoFault::Kind::output_lost);
  if (reaches) {
    held_output_ = output;
    writes_.store(writes_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  return output;
}

IoCounters SimLoopIo::counters() const noexcept {
  IoCounters counters;
  counters.writes = writes_.load(std::memory_order_relaxed);
  counters.connected = true;
  return counters;
}

}  // namespace loopwarden::hal::sim
