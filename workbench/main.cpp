// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "hal/os/standard_streams.hpp"
#include "workbench/command_line.hpp"
#include "workbench/daemon_client.hpp"
#include "workbench/installed_files.hpp"
#include "workbench/output_files.hpp"
#include "workbench/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

// Wrong usage, --help and --version. CLI11 prints by streams of its own, whose failures nobody sees.
int say(const CLI::App& app, const CLI::ParseError& what) {
  std::ostringstream out;
  std::ostringstream error;
  const int code = app.exit(what, out, error);
  fmt::print("{}", out.str());
  fmt::print(stderr, "{}", error.str());
  return code == 0 ? kExitOk : kExitUsage;
}

int run(int argc, char** argv) {
  CLI::App app("loopwarden - the workbench: simulate, check and watch flow loops", "loopwarden");
  app.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 64 usage, 65 bad data, 74 I/O, 75 try again, 78 bad configuration.\n"
      "Each subcommand has its own --help; `loopwarden help COMMAND` prints it.");
  int exit_code = kExitOk;
  add_check(app, exit_code);
  add_simulate(app, exit_code);
  add_jacket_study(app, exit_code);
  add_top(app, exit_code);
  add_set(app, exit_code);
  add_record(app, exit_code);
  add_alarms(app, exit_code);
  add_register_map(app, exit_code);
  add_export(app, exit_code);
  add_diagnose(app, exit_code);
  add_diagnose_study(app, exit_code);
  add_plant1_study(app, exit_code);
  add_alarm_study(app, exit_code);
  add_specialist_study(app, exit_code);
  add_train(app, exit_code);
  add_classify(app, exit_code);
  add_replay(app, exit_code);
  add_gap(app, exit_code);
  add_demo(app, exit_code);
  add_effects(app, exit_code);
  add_identify(app, exit_code);
  add_compare(app, exit_code);
  add_limit_cycle(app, exit_code);
  add_valve_test(app, exit_code);
  add_autotune(app, exit_code);
  add_gallery(app, exit_code);
  add_tune(app, exit_code);
  look_in_package(app);
  refuse_negative_counts(app);
  std::vector<std::string> words = in_options({argv + 1, argv + argc});
  const std::string unknown = unknown_word(app, words);
  if (!unknown.empty()) {
    fmt::print(stderr, "loopwarden: {}\n", unknown);
    return kExitUsage;
  }
  try {
    std::reverse(words.begin(), words.end());  // as CLI11 takes them
    app.parse(words);
  } catch (const CLI::ParseError& e) {
    return say(app, e);
  } catch (const OutputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.exit_code();
  } catch (const DaemonRefused& e) {
    fmt::print(stderr, "loopwarden: {}\n", e.what());
    return e.exit_code();
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden: {}\n", e.what());
    return kExitIo;
  }
  return exit_code;
}

}  // namespace
}  // namespace loopwarden::workbench

int main(int argc, char** argv) {
  loopwarden::hal::os::StandardStreams streams;
  return streams.finish(loopwarden::workbench::run(argc, argv));
}
