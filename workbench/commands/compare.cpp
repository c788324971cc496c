// SPDX-License-Identifier: Apache-2.0
// loopwarden compare: compares the valve compensators on a loop model.
#include "workbench/commands/subcommands.hpp"
#include "workbench/compare/comparison.hpp"

namespace loopwarden::workbench {

void add_compare(Program& program) {
  auto [command, o] =
      program.command("compare", "Compare the valve compensators on a model", run_comparison);
  add_comparison_options(command, o);
  command.footer("Example: loopwarden compare examples/models/plant1.yaml --out compare");
}

}  // namespace loopwarden::workbench
