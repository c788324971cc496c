// SPDX-License-Identifier: Apache-2.0
// Each study is a subcommand that registers itself with its options. `exit_code` receives the exit
// code of the study that ran.
#pragma once

#include <CLI/CLI.hpp>

#include "base/exit_code.hpp"

namespace loopwarden::lab {

void add_alarm(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_diagnose(CLI::App& app, int& exit_code);
void add_gallery(CLI::App& app, int& exit_code);
void add_gap(CLI::App& app, int& exit_code);
void add_identify(CLI::App& app, int& exit_code);
void add_calm(CLI::App& app, int& exit_code);
void add_plant(CLI::App& app, int& exit_code);
void add_plant1(CLI::App& app, int& exit_code);
void add_receipt(CLI::App& app, int& exit_code);
void add_specialist(CLI::App& app, int& exit_code);

}  // namespace loopwarden::lab
