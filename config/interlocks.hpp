// SPDX-License-Identifier: Apache-2.0
// What may act on a valve depends on what is behind the loop: the one place that says so. A file is
// judged by its own backend when it is read, a running loop by the backend that runs.
#pragma once

#include "config/loop_config.hpp"

namespace loopwarden::config {

// What a loop is wired to.
struct Backing {
  bool hardware = false;  // something real moves; false: a simulated plant, or a record
};

Backing backing_of(const Io& io) noexcept;

// Why the jacket may not act, whoever asks for it.
struct JacketInterlocks {
  bool paper = false;           // that form acts in `simulate` and `compare` only
  bool max_mean_error = false;  // on hardware it does not act without that limit

  bool none() const noexcept { return !paper && !max_mean_error; }
};
JacketInterlocks interlocks_of(const control::JacketSettings& jacket, Backing backing) noexcept;

// What a compensator lacks that acts on hardware: the key, nullptr for none.
const char* lacks(const control::CompensatorSettings& compensator, Backing backing) noexcept;
// On hardware planned_moves acts only where s is known within a factor of two.
bool too_wide(const control::CompensatorSettings& compensator, Backing backing) noexcept;

// Planned moves as corrective action.
bool moves_may_act(const monitor::CorrectiveSettings& corrective, Backing backing) noexcept;

}  // namespace loopwarden::config
