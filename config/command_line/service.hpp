// SPDX-License-Identifier: Apache-2.0
// What the programs that run as services have in common.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>

namespace loopwarden::config {

// Wrong usage, --help or --version, as CLI11 met it; returns the exit code.
int say(const CLI::App& app, const CLI::ParseError& what);

// Reads the command line of a program without commands, and does `run`. Wrong usage is 64, whatever `run` throws 74.
int run_service(CLI::App& app, int argc, char** argv, const std::function<int()>& run);

// What is logged goes to the error output, a line each, with its time in UTC.
void log_to_stderr(const std::string& program, const std::string& level);

}  // namespace loopwarden::config
