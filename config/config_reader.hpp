// SPDX-License-Identifier: Apache-2.0
// Reads the daemon's configuration:
//   DIR/loopwardend.yaml    the daemon itself; may be absent
//   DIR/loops.d/*.yaml      one loop each, in the order of their names
// and checks that the files fit together. All errors of all files are found in one pass.
// docs/configuration.md lists every key.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "config/loop_config.hpp"

namespace loopwarden::config {

// Texts that are to become files of the folder, by path: read in their place.
using Drafts = std::map<std::filesystem::path, std::string>;
Loaded<Configuration> read_configuration(const std::filesystem::path& directory,
                                         const Drafts& drafts = {});

// One loop file by itself; the links and feeders it names come from ../loopwardend.yaml beside its folder.
Loaded<LoopConfig> read_loop_file(const std::filesystem::path& path);

// The same from text. `file` is the name that diagnostics carry, and where relative paths start.
Loaded<LoopConfig> read_loop_text(const std::string& file, std::string_view text,
                                  const DaemonConfig& daemon);
Loaded<DaemonConfig> read_daemon_text(const std::string& file, std::string_view text);

KeyReference describe_daemon();
KeyReference describe_loop();
KeyReference describe_watched_loop();

}  // namespace loopwarden::config
