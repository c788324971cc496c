// SPDX-License-Identifier: Apache-2.0
// What the commands have in common of the command line.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "workbench/files/installed_files.hpp"

namespace loopwarden::workbench {

// --json, as every command that prints a result has it.
CLI::Option* add_json_flag(CLI::App& sub, bool& json);

// Looks in the package (installed()) for all that commands read of records, models, specialists and configurations.
void look_in_package(CLI::App& app, const std::string& share = kShare);

// Counts are not negative: CLI11 takes -1 for 18446744073709551615.
void refuse_negative_counts(CLI::App& app);

}  // namespace loopwarden::workbench
