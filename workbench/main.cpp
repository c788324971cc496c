// SPDX-License-Identifier: Apache-2.0
#include "base/standard_streams.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

int run(int argc, char** argv) {
  Program program(
      "loopwarden",
      "loopwarden - diagnose control valves, simulate and check control loops, operate the daemon",
      "Exit codes: 0 done, 64 usage, 65 bad data, 74 I/O, 75 try again, 78 bad configuration.\n"
      "Each subcommand has its own --help; `loopwarden help COMMAND` prints it.");
  for (const auto add :
       {add_check,    add_simulate,     add_top,         add_set,        add_reload,   add_record,
        add_alarms,   add_register_map, add_export,      add_import,     add_survey,   add_outcome,
        add_receipt,  add_batch,        add_discover,    add_diagnose,   add_train,    add_classify,
        add_replay,   add_explain,      add_gap,         add_commission, add_demo,     add_effects,
        add_identify, add_compare,      add_limit_cycle, add_valve_test, add_autotune, add_tune,
        add_setup}) {
    add(program);
  }
  return program.run(argc, argv);
}

}  // namespace
}  // namespace loopwarden::workbench

int main(int argc, char** argv) {
  loopwarden::base::StandardStreams streams;
  return streams.finish(loopwarden::workbench::run(argc, argv));
}
