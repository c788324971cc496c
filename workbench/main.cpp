// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <exception>

#include "workbench/installed_files.hpp"
#include "workbench/subcommands.hpp"

int main(int argc, char** argv) {
  namespace workbench = loopwarden::workbench;
  CLI::App app("loopwarden - the workbench: simulate, check and watch flow loops", "loopwarden");
  app.set_version_flag("--version", LOOPWARDEN_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 64 usage, 65 bad data, 74 I/O, 75 try again, 78 bad configuration.\n"
      "Each subcommand has its own --help.");
  int exit_code = workbench::kExitOk;
  workbench::add_check(app, exit_code);
  workbench::add_simulate(app, exit_code);
  workbench::add_jacket_study(app, exit_code);
  workbench::add_top(app, exit_code);
  workbench::add_set(app, exit_code);
  workbench::add_record(app, exit_code);
  workbench::add_alarms(app, exit_code);
  workbench::add_register_map(app, exit_code);
  workbench::add_export(app, exit_code);
  workbench::add_diagnose(app, exit_code);
  workbench::add_diagnose_study(app, exit_code);
  workbench::add_plant1_study(app, exit_code);
  workbench::add_alarm_study(app, exit_code);
  workbench::add_specialist_study(app, exit_code);
  workbench::add_train(app, exit_code);
  workbench::add_classify(app, exit_code);
  workbench::add_replay(app, exit_code);
  workbench::add_gap(app, exit_code);
  workbench::add_demo(app, exit_code);
  workbench::add_effects(app, exit_code);
  workbench::add_identify(app, exit_code);
  workbench::add_compare(app, exit_code);
  workbench::add_limit_cycle(app, exit_code);
  workbench::add_valve_test(app, exit_code);
  workbench::add_autotune(app, exit_code);
  workbench::add_gallery(app, exit_code);
  workbench::add_tune(app, exit_code);
  workbench::look_in_package(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? workbench::kExitOk : workbench::kExitUsage;
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden: {}\n", e.what());
    return workbench::kExitIo;
  }
  return exit_code;
}
