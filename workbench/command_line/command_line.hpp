// SPDX-License-Identifier: Apache-2.0
// What the commands have in common of the command line.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

namespace loopwarden::workbench {

// --socket, with the daemon of the package or LOOPWARDEN_SOCKET in its place.
void add_socket_option(CLI::App& sub, std::string& socket);
// --json, as every command that prints a result has it.
CLI::Option* add_json_flag(CLI::App& sub, bool& json);

// Counts are not negative: CLI11 takes -1 for 18446744073709551615.
void refuse_negative_counts(CLI::App& app);

}  // namespace loopwarden::workbench
