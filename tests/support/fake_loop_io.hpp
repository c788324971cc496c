// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/contract/loop_io.hpp"

namespace loopwarden::tests {

// A backend with inputs set by the test. It stores the commands for the test.
class FakeLoopIo final : public hal::LoopIo {
 public:
  FakeLoopIo() {
    inputs.output_ok = true;
    inputs.output_reason = hal::Reason::none;
  }

  void open() override {}
  void close() noexcept override {}
  bool drive(double output, std::chrono::milliseconds, std::string&) override {
    driven = output;
    return true;
  }
  void read(const hal::CycleTime& time, hal::Inputs& out) noexcept override {
    if (fresh) {
      inputs.process_variable.time_ns = time.now_ns;
      inputs.valve_position.time_ns = time.now_ns;
    }
    out = inputs;
  }
  double write(const hal::CycleTime&, const hal::Command& command) noexcept override {
    last = command;
    ++commands;
    if (command.write) ++writes;
    if (command.write) written = device ? device(command.output) : command.output;
    return written;
  }
  hal::IoCounters counters() const noexcept override { return {}; }

  void set_pv(double value, hal::Quality quality = hal::Quality::good,
              hal::Reason reason = hal::Reason::none) {
    inputs.process_variable.value = value;
    inputs.process_variable.quality = quality;
    inputs.process_variable.reason = reason;
  }
  void set_read_back(double value) {
    inputs.valve_position_fitted = true;
    inputs.valve_position.value = value;
    inputs.valve_position.quality = hal::Quality::good;
    inputs.valve_position.reason = hal::Reason::none;
  }

  hal::Inputs inputs;
  bool fresh = true;                   // samples carry the time of the cycle
  double (*device)(double) = nullptr;  // the device's reaction to a command
  hal::Command last;
  double written = -1.0;  // last value to be written; -1: none yet
  double driven = -1.0;
  std::uint64_t commands = 0;
  std::uint64_t writes = 0;  // number of values to be written
};

}  // namespace loopwarden::tests
