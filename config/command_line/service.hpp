// SPDX-License-Identifier: Apache-2.0
// Common functions of the programs that run as services.
#pragma once

#include <CLI/CLI.hpp>
#include <spdlog/formatter.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace loopwarden::config {

// Prints wrong usage, --help or --version as CLI11 reports it. Returns the exit code.
int say(const CLI::App& app, const CLI::ParseError& what);

// Converts `help COMMAND` and `version` to options.
std::vector<std::string> in_options(std::vector<std::string> words);

// Reads the command line, without the program's name, and calls `run`. Returns the exit code: 64
// after wrong usage, 74 if `run` or a command throws.
int run_service(CLI::App& app, std::vector<std::string> words, const std::function<int()>& run);

// Returns the form of log lines on the error output. If the journal of systemd reads it, a line
// starts with its priority, for example "<4>", and has no time, because the journal stores both.
// Otherwise a line starts with the time in UTC and the level.
std::unique_ptr<spdlog::formatter> log_formatter();

// Sends log lines to the error output, in the form of log_formatter().
void log_to_stderr(const std::string& program, const std::string& level);

}  // namespace loopwarden::config
