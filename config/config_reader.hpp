// SPDX-License-Identifier: Apache-2.0
// Reads the daemon's configuration:
//   DIR/loopwardend.yaml    the daemon itself; may be absent
//   DIR/loops.d/*.yaml      one loop each, in the order of their names
// and checks that the files fit together. All errors of all files are found in one pass.
// docs/configuration.md lists every key.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "config/loop_config.hpp"
#include "config/loop_reader.hpp"

namespace loopwarden::config {

// Texts that are to become files of the folder, by path: read in their place.
using Drafts = std::map<std::filesystem::path, std::string>;

// Reports what is wrong with the files that a loop's file names; errors in those themselves go into
// `of_named_files`. Called for each loop whose file has no error.
using LoopCheck = std::function<void(const LoopFile& loop, Report& report,
                                     std::vector<Diagnostic>& of_named_files)>;

// The output of a loop, for its stop action.
struct StopOutput {
  LoopConfig loop;
  std::string why_not;  // where it goes, or where to, is not known; empty: it can be driven
};

// A folder as far as it can be read.
struct FolderReading {
  // Loops whose files have errors are out of service in it, each in its place.
  Configuration configuration;
  std::vector<StopOutput> outputs;  // of all loops that are controlled here
  std::vector<Diagnostic> diagnostics;
  bool sound = false;  // no errors
  // All errors concern single loops and links, and at least one loop can run.
  bool runnable = false;
};
FolderReading read_folder(const std::filesystem::path& directory, const Drafts& drafts = {},
                          const LoopCheck& check = {});

// All or nothing.
Loaded<Configuration> loaded(FolderReading reading);
Loaded<Configuration> read_configuration(const std::filesystem::path& directory,
                                         const Drafts& drafts = {});

// One loop file by itself; the links and feeders it names come from ../loopwardend.yaml beside its folder.
Loaded<LoopConfig> read_loop_file(const std::filesystem::path& path, const LoopCheck& check = {});

// The same from text. `file` is the name that diagnostics carry, and where relative paths start.
Loaded<LoopConfig> read_loop_text(const std::string& file, std::string_view text,
                                  const DaemonConfig& daemon);
Loaded<DaemonConfig> read_daemon_text(const std::string& file, std::string_view text);

KeyReference describe_daemon();
KeyReference describe_loop();
KeyReference describe_watched_loop();

}  // namespace loopwarden::config
