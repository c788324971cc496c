// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "config/diagnostic.hpp"

namespace loopwarden::config {

inline constexpr std::size_t kMostFileBytes = 1024UL * 1024UL;

// Returns the bytes of a regular file of at most kMostFileBytes. Otherwise returns nullopt and
// reports the reason.
std::optional<std::string> read_source_file(const std::filesystem::path& path, Report& report);

// Resolves `path` as written in `referring_file`: relative paths start from that file's folder.
std::filesystem::path resolve(const std::string& referring_file, const std::string& path);

}  // namespace loopwarden::config
