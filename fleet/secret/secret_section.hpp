// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/map_reader.hpp"
#include "fleet/secret/secret.hpp"

namespace loopwarden::fleet {

// {credential: NAME} or {file: PATH} at `key`; none where the key is absent. `file`: where relative paths start.
Secret read_secret_section(config::MapReader& in, std::string_view key, const char* meaning,
                           const std::string& file);

}  // namespace loopwarden::fleet
