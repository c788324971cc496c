// SPDX-License-Identifier: Apache-2.0
// Validates a configuration: the one judgement for `loopwarden check`, `loopwardend --check`, the
// start, a reload, its dry run and `loopwarden setup`. All that a start refuses because of
// what files say is an error here, also in files that loop files name: twins, specialists, records
// to replay. What depends on the machine, such as a port that is in use or a device that is absent,
// is none.
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

// All or nothing, without the specialists.
Loaded<Configuration> validate_all(const std::filesystem::path& directory,
                                   const Drafts& drafts = {});

// One loop file by itself, with the files that it names.
Loaded<LoopConfig> validate_loop_file(const std::filesystem::path& path);

}  // namespace loopwarden::config
