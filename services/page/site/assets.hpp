// SPDX-License-Identifier: Apache-2.0
// The site as it stands in the program: every file that a browser asks for, by its path.
#pragma once

#include <span>
#include <string_view>

namespace loopwarden::page {

struct Asset {
  std::string_view path;  // as in the URL: "/index.html", "/lib/live.js"
  std::string_view type;  // Content-Type
  std::string_view body;
};

// All of them, sorted by path; "/" itself is not among them. Lives as long as the program.
std::span<const Asset> assets();

}  // namespace loopwarden::page
