// SPDX-License-Identifier: Apache-2.0
// Keys whose values are files. `file` is the one that is read: relative paths start from its folder.
#pragma once

#include <string>
#include <string_view>

#include "base/secret/secret.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

// `fallback`, as written in the same file, if the key is absent. Empty stays empty.
std::string read_path(MapReader& in, std::string_view key, const char* meaning,
                      const std::string& file, std::string fallback = "");

// {credential: NAME} or {file: PATH} at `key`; none if the key is absent.
base::Secret read_secret_at(MapReader& in, std::string_view key, const char* meaning,
                            const std::string& file);

}  // namespace loopwarden::config
