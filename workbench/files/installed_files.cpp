// SPDX-License-Identifier: Apache-2.0
#include "workbench/files/installed_files.hpp"

#include <algorithm>
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

constexpr std::array kPlaces{Place{"data/", "loopwarden/"},
                             Place{"config/examples/", "doc/loopwarden/examples/"}};

// Of options and positional arguments that are read. Nothing that is written stands here.
constexpr std::array kRead{"record", "model",     "target",   "files",         "--model",
                           "--data", "--records", "--config", "--specialists", "--signatures"};

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

void look_in_package(CLI::App& app, const std::string& share) {
  for (CLI::App* sub : app.get_subcommands([](CLI::App*) { return true; })) {
    look_in_package(*sub, share);
    for (CLI::Option* option : sub->get_options()) {
      const bool read = std::any_of(kRead.begin(), kRead.end(), [option](const char* name) {
        return option->check_name(name);
      });
      if (read) {
        option->transform([share](const std::string& path) { return installed(path, share); });
      }
    }
  }
}

}  // namespace loopwarden::workbench
