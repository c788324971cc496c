// SPDX-License-Identifier: Apache-2.0
// Decides which functions may move the valve, by the kind of the loop's backend. All such rules are
// here. A file is checked with its own backend when it is read, a running loop with its running
// backend.
#pragma once

#include "config/loop_config.hpp"

namespace loopwarden::config {

// The kind of a loop's backend.
struct Backing {
  bool hardware = false;  // a real valve moves; false: a simulated plant or a replayed record
};

Backing backing_of(const Io& io) noexcept;

// Returns the connection that gives PV: the name of a feeder, or "link NAME (Modbus HOST:PORT)".
// Returns an empty text for other backends.
std::string connection_of(const Io& io);

// Reasons why the jacket must not act, for all kinds of requests.
struct JacketInterlocks {
  bool paper = false;           // the form `paper` acts in `simulate` and `compare` only
  bool max_mean_error = false;  // on hardware it needs this limit

  bool none() const noexcept { return !paper && !max_mean_error; }
};
JacketInterlocks interlocks_of(const control::JacketSettings& jacket, Backing backing) noexcept;

// Returns the missing key of a compensator that acts on hardware; nullptr if it is complete.
const char* lacks(const control::CompensatorSettings& compensator, Backing backing) noexcept;
// Returns whether s is too uncertain: on hardware planned_moves needs s within a factor of two.
bool too_wide(const control::CompensatorSettings& compensator, Backing backing) noexcept;

// Returns whether planned moves may act as corrective action.
bool moves_may_act(const alarm::CorrectiveSettings& corrective, Backing backing) noexcept;

}  // namespace loopwarden::config
