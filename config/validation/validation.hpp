// SPDX-License-Identifier: Apache-2.0
// Validates a configuration. All programs use this check: `loopwarden check`, `loopwardend
// --check`, the start, a reload, its dry run and `loopwarden setup`. Each fault in files that
// prevents a start is an error here, also in files that loop files refer to: twins, specialists,
// records to replay. Conditions of the machine are not checked, such as a port in use or an absent
// device.
#pragma once

#include <filesystem>

#include "config/config_reader.hpp"
#include "config/validation/specialist_files.hpp"

namespace loopwarden::config {

struct Validated {
  FolderReading reading;
  Specialists specialists;  // of the loops that can be run
};
Validated validate(const std::filesystem::path& directory, const Drafts& drafts = {});

// Returns the whole configuration or only errors, without the specialists.
Loaded<Configuration> validate_all(const std::filesystem::path& directory,
                                   const Drafts& drafts = {});

// Validates one loop file and the files that it refers to.
Loaded<LoopConfig> validate_loop_file(const std::filesystem::path& path);

}  // namespace loopwarden::config
