// SPDX-License-Identifier: Apache-2.0
// What a program of many commands does with its command line.
#pragma once

#include <CLI/CLI.hpp>

namespace loopwarden::workbench {

// Runs the command that the words name; `exit_code` is where the commands of `app` leave theirs. Returns the program's.
// Prints what is wrong with the words, and what a command throws.
int run_program(CLI::App& app, const int& exit_code, int argc, char** argv);

}  // namespace loopwarden::workbench
