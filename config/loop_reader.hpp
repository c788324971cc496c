// SPDX-License-Identifier: Apache-2.0
// Reads a loop file: one control loop of the daemon. docs/reference/configuration.md lists all
// keys.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/io_reader.hpp"
#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

struct LoopFile {
  LoopConfig config;
  Place tag;
  Place master;           // of the master's tag
  Place command;          // place of the output's register or channel
  bool hardware = false;  // a real valve moves
  bool watched = false;   // another controller runs the loop
  // Output and stop action have no error, even if other keys have: `loopwardend --safe` can drive
  // the output.
  bool output_known = false;
  std::vector<LinkUse> link_uses;
  Place twin, specialists, record;  // places of the names of these files
};

// Returns whether a text can be a tag, which is part of file names and command lines.
bool is_usable_tag(std::string_view tag);
// Reads a loop with the links and feeders of `daemon`.
LoopFile read_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon);
// Reads a loop with `control: elsewhere`.
LoopFile read_watched_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon);

}  // namespace loopwarden::config
