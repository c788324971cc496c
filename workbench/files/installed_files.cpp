// SPDX-License-Identifier: Apache-2.0
#include "workbench/files/installed_files.hpp"

#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace loopwarden::workbench {
namespace {

struct Place {
  std::string_view source;
  std::string_view share;
};

// The first place that has the file counts. The last two are the names up to version 0.2.
constexpr std::array kPlaces{
    Place{"examples/", "loopwarden/"}, Place{"examples/", "doc/loopwarden/examples/"},
    Place{"data/", "loopwarden/"}, Place{"config/examples/", "doc/loopwarden/examples/"}};

bool is_there(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

}  // namespace

std::string installed(const std::string& path, const std::string& share) {
  if (is_there(path)) return path;
  const std::string_view name = path.starts_with("./") ? std::string_view(path).substr(2) : path;
  for (const Place& place : kPlaces) {
    if (!name.starts_with(place.source)) continue;
    std::string in_package = share + "/" + std::string(place.share);
    in_package += name.substr(place.source.size());
    if (is_there(in_package)) return in_package;
  }
  return path;
}

}  // namespace loopwarden::workbench
