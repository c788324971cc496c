// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/command_line.hpp"

#include <algorithm>
#include <array>

namespace loopwarden::workbench {

namespace {

// Options and positional arguments of input files. Options of output files are not in this list.
constexpr std::array kRead{"record", "model",     "target",   "files",         "--model",
                           "--data", "--records", "--config", "--specialists", "--signatures"};

}  // namespace

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

CLI::Option* add_json_flag(CLI::App& sub, bool& json) {
  return sub.add_flag("--json", json, "print the result as JSON");
}

void refuse_negative_counts(CLI::App& app) {
  for (CLI::App* sub : app.get_subcommands([](CLI::App*) { return true; })) {
    refuse_negative_counts(*sub);
    for (CLI::Option* option : sub->get_options()) {
      if (!option->get_type_name().starts_with("UINT")) continue;
      option->check([](const std::string& value) {
        return value.starts_with('-') ? "must not be negative (got " + value + ")" : std::string();
      });
    }
  }
}

}  // namespace loopwarden::workbench
