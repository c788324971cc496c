// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/map_reader.hpp"
#include "base/secret/secret.hpp"

namespace loopwarden::config {

// {credential: NAME} or {file: PATH} at `key`; none where the key is absent. `file`: where relative paths start.
base::Secret read_secret_section(MapReader& in, std::string_view key, const char* meaning,
                                 const std::string& file);

}  // namespace loopwarden::config
