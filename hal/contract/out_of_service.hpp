// SPDX-License-Identifier: Apache-2.0
// Replaces the wiring of a loop that is out of service: no device is read or written, and all
// values are bad.
#pragma once

#include <string>

#include "hal/contract/loop_io.hpp"
#include "hal/contract/loop_source.hpp"

namespace loopwarden::hal {

inline constexpr Sample kOutOfService{.reason = Reason::out_of_service};

class OutOfServiceIo final : public LoopIo {
 public:
  void open() override {}
  void close() noexcept override {}
  bool drive(double, std::chrono::milliseconds, std::string& why) override {
    why = "the loop is out of service";
    return false;
  }
  void read(const CycleTime&, Inputs& inputs) noexcept override {
    inputs = {.process_variable = kOutOfService, .valve_position = kOutOfService};
  }
  double write(const CycleTime&, const Command& command) noexcept override {
    return command.output;
  }
  IoCounters counters() const noexcept override { return {}; }
};

class OutOfServiceSource final : public LoopSource {
 public:
  void open() override {}
  void close() noexcept override {}
  void read(SourceInputs& inputs) noexcept override {
    const SourceSample none{.sample = kOutOfService};
    inputs = {none, none, none, none, none};
  }
  IoCounters counters() const noexcept override { return {}; }
};

}  // namespace loopwarden::hal
