// SPDX-License-Identifier: Apache-2.0
// Reads the layout of an export from a small YAML file (docs/reference/import-formats.md lists
// every key).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "record/import/layout.hpp"

namespace loopwarden::workbench {

config::Loaded<record::ImportOptions> read_format_file(const std::filesystem::path& path);
config::Loaded<record::ImportOptions> read_format_text(const std::string& file,
                                                       std::string_view text);
config::KeyReference describe_format();

}  // namespace loopwarden::workbench
