// SPDX-License-Identifier: Apache-2.0
// A loop file: one control loop of the daemon. docs/configuration.md lists every key.
#pragma once

#include <string>
#include <string_view>

#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

struct LoopFile {
  LoopConfig config;
  Place tag;
  Place command;          // where the output's register or channel is stated
  bool hardware = false;  // something real moves
};

// A tag names files and appears on command lines.
bool is_usable_tag(std::string_view tag);
// Links and feeders are those of `daemon`.
LoopFile read_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon);
// One with `control: elsewhere`.
LoopFile read_watched_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon);

}  // namespace loopwarden::config
