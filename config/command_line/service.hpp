// SPDX-License-Identifier: Apache-2.0
// What the programs that run as services have in common.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>
#include <vector>

namespace loopwarden::config {

// Wrong usage, --help or --version, as CLI11 met it; returns the exit code.
int say(const CLI::App& app, const CLI::ParseError& what);

// `help COMMAND` and `version` as options.
std::vector<std::string> in_options(std::vector<std::string> words);

// Reads the command line, without the program's name, and does `run`. Returns the exit code: 64 after wrong usage, 74 if
// `run` or a command throws.
int run_service(CLI::App& app, std::vector<std::string> words, const std::function<int()>& run);

// What is logged goes to the error output, a line each, with its time in UTC.
void log_to_stderr(const std::string& program, const std::string& level);

}  // namespace loopwarden::config
