// SPDX-License-Identifier: Apache-2.0
// loopwarden compare: the valve compensators side by side on a loop model.
#include <memory>

#include "workbench/commands/subcommands.hpp"
#include "workbench/compare/comparison.hpp"

namespace loopwarden::workbench {

void add_compare(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ComparisonOptions>();
  CLI::App* sub = app.add_subcommand("compare", "the valve compensators side by side on a model");
  add_comparison_options(*sub, *options);
  sub->footer("Example: loopwarden compare config/examples/models/plant1.yaml --out compare");
  sub->callback([options, &exit_code] { exit_code = run_comparison(*options); });
}

}  // namespace loopwarden::workbench
