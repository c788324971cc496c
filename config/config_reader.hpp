// SPDX-License-Identifier: Apache-2.0
// Reads the daemon's configuration:
//   DIR/loopwardend.yaml    the daemon itself; may be absent
//   DIR/loops.d/*.yaml      one loop per file, in the order of their names
// It checks that the files fit together and finds all errors of all files in one pass.
// docs/reference/configuration.md lists all keys.
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

// Texts of files that are not yet written, by path. They are read instead of the files.
using Drafts = std::map<std::filesystem::path, std::string>;

// Reports errors about the files that a loop's file refers to. Errors inside those files are added
// to `of_named_files`. Called for each loop whose file has no error.
using LoopCheck = std::function<void(const LoopFile& loop, Report& report,
                                     std::vector<Diagnostic>& of_named_files)>;

// The output of a loop, for its stop action.
struct StopOutput {
  LoopConfig loop;
  std::string why_not;  // reason why the output or its target is unknown; empty: it can be driven
};

// A configuration folder, as far as it can be read.
struct FolderReading {
  // Loops with errors in their files stay in their place and are out of service.
  Configuration configuration;
  std::vector<StopOutput> outputs;  // of all loops that Loopwarden controls
  std::vector<Diagnostic> diagnostics;
  bool sound = false;  // no errors
  // True if all errors concern single loops and links, and at least one loop can run.
  bool runnable = false;
};
FolderReading read_folder(const std::filesystem::path& directory, const Drafts& drafts = {},
                          const LoopCheck& check = {});

// Return the whole configuration, or only errors.
Loaded<Configuration> loaded(FolderReading reading);
Loaded<Configuration> read_configuration(const std::filesystem::path& directory,
                                         const Drafts& drafts = {});

// Reads one loop file. Its links and feeders are defined in loopwardend.yaml in the parent of its
// folder.
Loaded<LoopConfig> read_loop_file(const std::filesystem::path& path, const LoopCheck& check = {});

// Reads a loop from text. `file` is the name in diagnostics and the base of relative paths.
Loaded<LoopConfig> read_loop_text(const std::string& file, std::string_view text,
                                  const DaemonConfig& daemon);
Loaded<DaemonConfig> read_daemon_text(const std::string& file, std::string_view text);

KeyReference describe_daemon();
KeyReference describe_loop();
KeyReference describe_watched_loop();

}  // namespace loopwarden::config
