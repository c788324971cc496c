// SPDX-License-Identifier: Apache-2.0
// Every subcommand is a file that registers itself with its options. The exit code of the one that
// ran ends up in `exit_code`.
#pragma once

#include <CLI/CLI.hpp>

#include "base/exit_code.hpp"

namespace loopwarden::workbench {

void add_check(CLI::App& app, int& exit_code);
void add_simulate(CLI::App& app, int& exit_code);
void add_top(CLI::App& app, int& exit_code);
void add_set(CLI::App& app, int& exit_code);
void add_record(CLI::App& app, int& exit_code);
void add_reload(CLI::App& app, int& exit_code);
void add_alarms(CLI::App& app, int& exit_code);
void add_register_map(CLI::App& app, int& exit_code);
void add_export(CLI::App& app, int& exit_code);
void add_import(CLI::App& app, int& exit_code);
void add_survey(CLI::App& app, int& exit_code);
void add_batch(CLI::App& app, int& exit_code);
void add_diagnose(CLI::App& app, int& exit_code);
void add_commission(CLI::App& app, int& exit_code);
void add_gap(CLI::App& app, int& exit_code);
void add_demo(CLI::App& app, int& exit_code);
void add_train(CLI::App& app, int& exit_code);
void add_classify(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_explain(CLI::App& app, int& exit_code);
void add_effects(CLI::App& app, int& exit_code);
void add_identify(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_limit_cycle(CLI::App& app, int& exit_code);
void add_valve_test(CLI::App& app, int& exit_code);
void add_autotune(CLI::App& app, int& exit_code);
void add_tune(CLI::App& app, int& exit_code);

}  // namespace loopwarden::workbench
