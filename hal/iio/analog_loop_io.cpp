// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_loop_io.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <thread>
#include <utility>

namespace loopwarden::hal::iio {
namespace {

constexpr std::chrono::milliseconds kDrivePoll{2};

void check(const AnalogSettings& settings, const std::string& name) {
  const auto require = [&name](bool holds, const char* what) {
    if (!holds) throw std::runtime_error(name + ": " + what);
  };
  require(settings.output.low != settings.output.high, "the output range is empty");
  require(settings.output.lowest_raw < settings.output.highest_raw,
          "the converter's raw range is empty");
  require(settings.process_variable.low != settings.process_variable.high,
          "the input range is empty");
  require(settings.poll_period_ns > 0, "the poll period must be above 0 s");
}

}  // namespace

AnalogLoopIo::AnalogLoopIo(AnalogSettings settings, std::string name, EventSink sink,
                           std::unique_ptr<GpioChips> chips)
    : settings_(std::move(settings)),
      name_(std::move(name)),
      sink_(std::move(sink)),
      chips_(chips ? std::move(chips) : system_gpio_chips()),
      task_(settings_, name_, *chips_, sink_) {}

AnalogLoopIo::~AnalogLoopIo() { close(); }

void AnalogLoopIo::open() {
  if (thread_.running()) return;
  check(settings_, name_);
  quit_.store(false, std::memory_order_release);
  task_.open(clock_.now_ns());
  thread_.start({.name = "lw-io", .fifo_priority = 0, .cpu = {}}, [this] { run(); });
}

void AnalogLoopIo::close() noexcept {
  if (!thread_.running()) return;
  quit_.store(true, std::memory_order_release);
  thread_.join();
  task_.close();
}

void AnalogLoopIo::run() {
  while (!quit_.load(std::memory_order_acquire)) {
    try {
      task_.step(clock_.now_ns());
    } catch (const std::exception& error) {
      report(sink_, false, name_ + ": " + error.what());
    }
    ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    clock_.sleep_until_ns(task_.due_ns(clock_.now_ns()));
  }
}

void AnalogLoopIo::read(const CycleTime& time, Inputs& inputs) noexcept {
  const AnalogState& state = task_.state.newest();
  inputs = state.inputs;
  // An I/O thread that hangs in its converter writes no output.
  if (inputs.output_ok && time.now_ns - state.time_ns > max_command_age_ns(settings_)) {
    inputs.output_ok = false;
    inputs.output_reason = Reason::link_lost;
  }
}

double AnalogLoopIo::output_stage(double output) noexcept {
  const AnalogState& state = task_.state.newest();
  if (state.stage_known) return state.stage.output_of(state.stage.raw_for(output));
  // The converter is still absent, but the limits of current are known.
  const auto [low, high] =
      std::minmax({output_at_ma(settings_.output, settings_.output.lowest_ma),
                   output_at_ma(settings_.output, settings_.output.highest_ma)});
  return std::clamp(output, low, high);
}

double AnalogLoopIo::write(const CycleTime&, const Command& command) noexcept {
  // NaN and infinity are never output: the last command is kept until it is too old.
  if (!std::isfinite(command.output)) return command_.output;
  command_ = {.output = output_stage(command.output),
              .time_ns = command.time_ns,
              .id = command_.id + 1,
              .write = command.write,
              .alarm = command.alarm,
              .parked = false};
  task_.commands.publish(command_);
  return command_.output;
}

bool AnalogLoopIo::drive(double output, std::chrono::milliseconds timeout, std::string& why) {
  if (!thread_.running()) {
    why = "the backend is not open";
    return false;
  }
  if (!std::isfinite(output)) {
    why = "not a finite number";
    return false;
  }
  const std::int64_t deadline = clock_.now_ns() + std::chrono::nanoseconds(timeout).count();
  const std::uint64_t first = command_.id + 1;
  AnalogState state;
  do {
    // Published repeatedly, so that it is tried as soon as the device is present.
    command_ = {.output = output_stage(output),
                .time_ns = clock_.now_ns(),
                .id = command_.id + 1,
                .write = true,
                .alarm = true,
                .parked = true};
    task_.commands.publish(command_);
    std::this_thread::sleep_for(kDrivePoll);
    task_.state.fetch(state);
  } while (state.written_id < first && clock_.now_ns() < deadline);
  if (state.written_id >= first) return true;
  why = name_ + " output has not taken the command: " + to_text(state.inputs.output_reason);
  return false;
}

}  // namespace loopwarden::hal::iio
