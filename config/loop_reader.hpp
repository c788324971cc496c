// SPDX-License-Identifier: Apache-2.0
// A loop file: one control loop of the daemon. docs/configuration.md lists every key.
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
  Place command;          // where the output's register or channel is stated
  bool hardware = false;  // something real moves
  bool watched = false;   // another controller has the loop
  // Output and stop action have no error, whatever else is wrong: `loopwardend --safe` can drive
  // it.
  bool output_known = false;
  std::vector<LinkUse> link_uses;
  Place twin, specialists, record;  // where the files that it names are stated
};

// A tag names files and appears on command lines.
bool is_usable_tag(std::string_view tag);
// Links and feeders are those of `daemon`.
LoopFile read_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon);
// One with `control: elsewhere`.
LoopFile read_watched_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon);

}  // namespace loopwarden::config
