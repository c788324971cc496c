// SPDX-License-Identifier: Apache-2.0
// The registration functions of all subcommands. Each subcommand has one file, which adds its
// options.
#pragma once

#include "workbench/command_line/command.hpp"

namespace loopwarden::workbench {

void add_check(Program& program);
void add_simulate(Program& program);
void add_top(Program& program);
void add_set(Program& program);
void add_setup(Program& program);
void add_record(Program& program);
void add_reload(Program& program);
void add_alarms(Program& program);
void add_register_map(Program& program);
void add_export(Program& program);
void add_import(Program& program);
void add_survey(Program& program);
void add_outcome(Program& program);
void add_receipt(Program& program);
void add_batch(Program& program);
void add_diagnose(Program& program);
void add_discover(Program& program);
void add_commission(Program& program);
void add_gap(Program& program);
void add_demo(Program& program);
void add_train(Program& program);
void add_classify(Program& program);
void add_replay(Program& program);
void add_explain(Program& program);
void add_effects(Program& program);
void add_identify(Program& program);
void add_compare(Program& program);
void add_limit_cycle(Program& program);
void add_valve_test(Program& program);
void add_autotune(Program& program);
void add_tune(Program& program);

}  // namespace loopwarden::workbench
