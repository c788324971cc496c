// SPDX-License-Identifier: Apache-2.0
// The workbench of ./demo: only the commands that the demonstration runs, so that it builds sooner.
#include "base/standard_streams.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

int run(int argc, char** argv) {
  Program program("loopwarden", "loopwarden - the commands of the workbench that ./demo runs",
                  "To build all commands: tools/install-packages build && cmake --preset release "
                  "&& cmake --build --preset release");
  for (const auto add : {add_simulate, add_commission, add_explain, add_demo}) add(program);
  return program.run(argc, argv);
}

}  // namespace
}  // namespace loopwarden::workbench

int main(int argc, char** argv) {
  loopwarden::base::StandardStreams streams;
  return streams.finish(loopwarden::workbench::run(argc, argv));
}
