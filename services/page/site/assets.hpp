// SPDX-License-Identifier: Apache-2.0
// The site as built into the program: every file that browsers request, by its path.
#pragma once

#include <span>
#include <string_view>

namespace loopwarden::page {

struct Asset {
  std::string_view path;  // as in the URL: "/index.html", "/lib/live.js"
  std::string_view type;  // Content-Type
  std::string_view body;
};

// Returns all files, sorted by path, without "/" itself. They live as long as the program.
std::span<const Asset> assets();

}  // namespace loopwarden::page
