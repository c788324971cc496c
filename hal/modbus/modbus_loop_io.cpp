// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_loop_io.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "hal/modbus/register_codec.hpp"

namespace loopwarden::hal::modbus {
namespace {

constexpr std::chrono::milliseconds kDrivePoll{5};
constexpr std::int64_t kDriveRetryNs = 250'000'000;

}  // namespace

ModbusLoopIo::ModbusLoopIo(LoopModbusSettings settings, const std::string& name, ModbusBus& bus)
    : settings_(std::move(settings)), bus_(bus) {
  transmitter_.name = name + " transmitter";
  transmitter_.period_ns = settings_.poll_period_ns;
  transmitter_.reads.push_back(std::make_unique<ReadPoint>(settings_.process_variable));
  process_variable_ = transmitter_.reads.back().get();

  positioner_.name = name + " positioner";
  positioner_.period_ns = settings_.poll_period_ns;
  positioner_.command =
      std::make_unique<CommandPoint>(settings_.command, max_command_age_ns(settings_),
                                     longest_silence_ns(settings_), settings_.comm_loss);
  if (settings_.read_back) {
    positioner_.reads.push_back(std::make_unique<ReadPoint>(*settings_.read_back));
    read_back_ = positioner_.reads.back().get();
  }
  last_output_ = output_stage(settings_.output.low);
}

ModbusLoopIo::~ModbusLoopIo() { close(); }

void ModbusLoopIo::open() {
  if (transmitter_link_ != nullptr) return;
  if (!(settings_.output.low < settings_.output.high)) {
    throw std::runtime_error(positioner_.name + ": the output range is empty");
  }
  if (settings_.command.reg.table != Table::holding_register) {
    throw std::runtime_error(positioner_.name + ": the command is not a holding register");
  }
  auto transmitter = bus_.link(settings_.transmitter_link, settings_.process_variable.unit);
  positioner_link_ = bus_.link(settings_.positioner_link, settings_.command.unit);
  transmitter_link_ = std::move(transmitter);
  transmitter_link_->attach(transmitter_);
  positioner_link_->attach(positioner_);
}

void ModbusLoopIo::close() noexcept {
  if (transmitter_link_ == nullptr) return;
  transmitter_link_->detach(transmitter_);
  positioner_link_->detach(positioner_);
  transmitter_link_.reset();
  positioner_link_.reset();
}

double ModbusLoopIo::output_stage(double output) const noexcept {
  const OutputStage& stage = settings_.output;
  double value = std::clamp(output, stage.low, stage.high);
  if (stage.resolution > 0.0) {
    value = stage.low + stage.resolution * std::round((value - stage.low) / stage.resolution);
    value = std::clamp(value, stage.low, stage.high);
  }
  return representable(settings_.command.reg, value);
}

void ModbusLoopIo::publish(double value, std::int64_t time_ns, bool write) noexcept {
  positioner_.command->newest.publish(
      {.value = value, .time_ns = time_ns, .id = ++command_id_, .write = write});
}

void ModbusLoopIo::read(const CycleTime& time, Inputs& inputs) noexcept {
  inputs.process_variable = process_variable_->newest.newest();
  inputs.valve_position_fitted = read_back_ != nullptr;
  inputs.valve_position = read_back_ != nullptr ? read_back_->newest.newest() : Sample{};
  inputs.enable = Enable::not_fitted;
  const OutputState& state = positioner_.command->state.newest();
  // A busy link does not report waiting commands. If the loop requests no write, no confirmation is
  // expected. After a loss the output stays lost until the device confirms a newer command.
  const std::int64_t since_ns = std::max(state.confirmed_ns, writes_since_ns_);
  const bool overdue = writes_ && time.now_ns - since_ns > positioner_.command->longest_silence_ns;
  if (state.ok && overdue) lost_id_ = command_id_;
  const bool silent = state.ok && state.written_id <= lost_id_;
  inputs.output_ok = state.ok && !silent;
  inputs.output_reason = silent ? Reason::link_lost : state.reason;
}

double ModbusLoopIo::write(const CycleTime&, const Command& command) noexcept {
  // NaN and infinity are never sent: the last command is kept until it is too old.
  if (!std::isfinite(command.output)) return last_output_;
  if (command.write && !std::exchange(writes_, command.write)) writes_since_ns_ = command.time_ns;
  writes_ = command.write;
  last_output_ = output_stage(command.output);
  publish(last_output_, command.time_ns, command.write);
  return last_output_;
}

bool ModbusLoopIo::drive(double output, std::chrono::milliseconds timeout, std::string& why) {
  if (positioner_link_ == nullptr) {
    why = "the backend is not open";
    return false;
  }
  if (!std::isfinite(output)) {
    why = "not a finite number";
    return false;
  }
  const std::int64_t deadline = BusWaiter::now_ns() + std::chrono::nanoseconds(timeout).count();
  const double value = output_stage(output);
  const std::uint64_t first_id = command_id_ + 1;
  std::int64_t ask_again_ns = 0;
  OutputState state;
  do {
    const std::int64_t now = BusWaiter::now_ns();
    publish(value, now, true);  // repeatedly, so that it does not become too old
    if (now >= ask_again_ns) {
      positioner_link_->serve_soon(positioner_);
      ask_again_ns = now + kDriveRetryNs;
    }
    std::this_thread::sleep_for(kDrivePoll);
    positioner_.command->state.fetch(state);
  } while (state.written_id < first_id && BusWaiter::now_ns() < deadline);

  publish(value, BusWaiter::now_ns(), false);
  last_output_ = value;
  if (state.written_id >= first_id) return true;
  why = "the positioner has not confirmed the command";
  if (state.reason != Reason::none) why += std::string(": ") + to_text(state.reason);
  return false;
}

IoCounters ModbusLoopIo::counters() const noexcept {
  IoCounters sum;
  add_to(sum, transmitter_.counters);
  add_to(sum, positioner_.counters);
  sum.connected = transmitter_.counters.connected.load(std::memory_order_relaxed) &&
                  positioner_.counters.connected.load(std::memory_order_relaxed);
  if (transmitter_link_ != nullptr) {
    sum.reconnects = transmitter_link_->reconnects();
    if (positioner_link_ != transmitter_link_) sum.reconnects += positioner_link_->reconnects();
  }
  return sum;
}

std::uint64_t ModbusLoopIo::ticks() const noexcept {
  if (transmitter_link_ == nullptr) return 0;
  return ticks_.of(std::array{transmitter_link_->ticks(), positioner_link_->ticks()});
}

}  // namespace loopwarden::hal::modbus
