// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "base/exit_code.hpp"
#include "base/standard_streams.hpp"
#include "lab/program/studies.hpp"
#include "workbench/command_line/program.hpp"

namespace loopwarden::lab {
namespace {

int run(int argc, char** argv) {
  CLI::App app("loopwarden-study - prints the figures that Loopwarden's documents state",
               "loopwarden-study");
  app.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  app.footer(
      "Exit codes: 0 done, 64 usage, 65 bad data, 74 I/O, 78 bad configuration.\n"
      "Each study has its own --help; lab/README.md lists the document with its results.");
  int exit_code = kExitOk;
  add_alarm(app, exit_code);
  add_compare(app, exit_code);
  add_diagnose(app, exit_code);
  add_gallery(app, exit_code);
  add_gap(app, exit_code);
  add_identify(app, exit_code);
  add_calm(app, exit_code);
  add_plant(app, exit_code);
  add_plant1(app, exit_code);
  add_receipt(app, exit_code);
  add_specialist(app, exit_code);
  return workbench::run_program(app, exit_code, argc, argv);
}

}  // namespace
}  // namespace loopwarden::lab

int main(int argc, char** argv) {
  loopwarden::base::StandardStreams streams;
  return streams.finish(loopwarden::lab::run(argc, argv));
}
