// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "base/exit_code.hpp"
#include "base/standard_streams.hpp"
#include "workbench/command_line/program.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/installed_files.hpp"

namespace loopwarden::workbench {
namespace {

int run(int argc, char** argv) {
  CLI::App app("loopwarden - the workbench: simulate, check and watch flow loops", "loopwarden");
  app.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  app.footer(
      "Exit codes: 0 done, 64 usage, 65 bad data, 74 I/O, 75 try again, 78 bad configuration.\n"
      "Each subcommand has its own --help; `loopwarden help COMMAND` prints it.");
  int exit_code = kExitOk;
  add_check(app, exit_code);
  add_simulate(app, exit_code);
  add_top(app, exit_code);
  add_set(app, exit_code);
  add_reload(app, exit_code);
  add_record(app, exit_code);
  add_alarms(app, exit_code);
  add_register_map(app, exit_code);
  add_export(app, exit_code);
  add_import(app, exit_code);
  add_survey(app, exit_code);
  add_batch(app, exit_code);
  add_diagnose(app, exit_code);
  add_train(app, exit_code);
  add_classify(app, exit_code);
  add_replay(app, exit_code);
  add_explain(app, exit_code);
  add_gap(app, exit_code);
  add_commission(app, exit_code);
  add_demo(app, exit_code);
  add_effects(app, exit_code);
  add_identify(app, exit_code);
  add_compare(app, exit_code);
  add_limit_cycle(app, exit_code);
  add_valve_test(app, exit_code);
  add_autotune(app, exit_code);
  add_tune(app, exit_code);
  look_in_package(app);
  return run_program(app, exit_code, argc, argv);
}

}  // namespace
}  // namespace loopwarden::workbench

int main(int argc, char** argv) {
  loopwarden::base::StandardStreams streams;
  return streams.finish(loopwarden::workbench::run(argc, argv));
}
