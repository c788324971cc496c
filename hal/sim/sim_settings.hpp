// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::hal::sim {

// A fault between plant and controller, with start and end (s of simulated time).
struct IoFault {
  enum class Kind : std::uint8_t {
    dead_sensor,   // the transmitter reports failure
    frozen,        // PV repeats its last value
    not_a_number,  // PV is NaN
    link_lost,     // no fresh values arrive and no command gets through
    output_lost,   // commands don't reach the positioner
    enable_open    // the enable contact opens
  };
  Kind kind = Kind::dead_sensor;
  double from_s = 0.0;
  double to_s = 0.0;

  friend bool operator==(const IoFault&, const IoFault&) = default;
};

struct SimSettings {
  plant::LoopModel model;          // its controller section is used only for the output's range
  double output_resolution = 0.0;  // CO units, of the simulated converter; 0: continuous
  std::vector<IoFault> io_faults;

  friend bool operator==(const SimSettings&, const SimSettings&) = default;
};

}  // namespace loopwarden::hal::sim
