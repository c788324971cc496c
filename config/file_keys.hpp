// SPDX-License-Identifier: Apache-2.0
// Reads keys whose values are paths of files. Relative paths start from the folder of `file`, the
// file that is being read.
#pragma once

#include <string>
#include <string_view>

#include "base/secret/secret.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

// Returns `fallback`, relative to the same folder, if the key is absent. An empty path stays empty.
std::string read_path(MapReader& in, std::string_view key, const char* meaning,
                      const std::string& file, std::string fallback = "");

// Reads {credential: NAME} or {file: PATH} at `key`; an empty secret if the key is absent.
base::Secret read_secret_at(MapReader& in, std::string_view key, const char* meaning,
                            const std::string& file);

}  // namespace loopwarden::config
