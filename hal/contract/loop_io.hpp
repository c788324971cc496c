// SPDX-License-Identifier: Apache-2.0
// The contract of each hardware backend. hal/README.md explains it on one page.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "hal/contract/device.hpp"
#include "hal/contract/sample.hpp"

namespace loopwarden::hal {

// The instant of one control cycle.
struct CycleTime {
  std::int64_t now_ns = 0;  // CLOCK_MONOTONIC at the start of the cycle
  std::uint64_t period_index =
      0;  // sampling periods since start; jumps by more than one on an overrun
};

// State of the contact that permits control. Not a safety function: an emergency stop must act in
// hardware.
enum class Enable : std::uint8_t { not_fitted, closed, open };

struct Inputs {
  Sample process_variable;  // PV units
  Sample
      valve_position;  // read-back of the valve's actual position, CO units; never_received if not
                       // fitted
  bool valve_position_fitted = false;
  Enable enable = Enable::not_fitted;
  // Whether commands reach the positioner: false from a failed write until one succeeds, and, with
  // the reason never_received, before the first command.
  bool output_ok = false;
  Reason output_reason = Reason::never_received;
};

struct Command {
  double output = 0.0;       // CO units
  std::int64_t time_ns = 0;  // when the loop decided; a backend never repeats an old command
  bool write = false;        // false: leave the device as it is
  bool alarm = false;        // alarm relay, if fitted (relay de-energised on alarm)
};

class LoopIo : public Device {
 public:
  // --- set-up thread, may block and allocate -------------------------------------------------

  // With the loop stopped: puts `output` (CO units) on the device and waits until the device has
  // it. Returns false, with the reason in `why`, if that did not happen within `timeout`.
  virtual bool drive(double output, std::chrono::milliseconds timeout, std::string& why) = 0;

  // --- real-time thread: never allocates, locks, throws or blocks ----------------------------

  // Returns the newest inputs, whatever their age.
  virtual void read(const CycleTime& time, Inputs& inputs) noexcept = 0;

  // Hands over a command. Returns the output after converter resolution and limits, CO units: the
  // anti-windup uses this value.
  virtual double write(const CycleTime& time, const Command& command) noexcept = 0;
};

}  // namespace loopwarden::hal
