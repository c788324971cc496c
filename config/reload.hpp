// SPDX-License-Identifier: Apache-2.0
// What a reload can't take over while the loops run: these values wait for a restart.
#pragma once

#include <string>
#include <vector>

#include "config/loop_config.hpp"

namespace loopwarden::config {

struct Waiting {
  std::string file;  // where the new value stands
  std::string key;   // such as modbus_server.port; "loop" for a loop that came or went
  std::string why;   // what becomes of it, in words

  friend bool operator==(const Waiting&, const Waiting&) = default;
};

// "FILE: KEY: WHY"
std::string to_text(const Waiting& waiting);

// `running`: as at the start; `wanted`: the files of now. Empty: all of them can be in force.
std::vector<Waiting> waiting_for_restart(const Configuration& running, const Configuration& wanted);

}  // namespace loopwarden::config
