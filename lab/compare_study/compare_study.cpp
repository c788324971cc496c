// SPDX-License-Identifier: Apache-2.0
// loopwarden-study compare: runs `loopwarden compare` with slower plants in addition to the model's
// own.
#include <memory>

#include "lab/program/studies.hpp"
#include "workbench/compare/comparison.hpp"

namespace loopwarden::lab {

void add_compare(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<workbench::ComparisonOptions>();
  options->plants = workbench::ComparedPlants::own_and_others;
  CLI::App* sub =
      app.add_subcommand("compare", "Compare the valve compensators on a grid of three plants");
  workbench::Command command(*sub);
  workbench::add_comparison_options(command, *options);
  sub->footer("Example: loopwarden-study compare examples/models/plant1.yaml --out compare");
  sub->callback([options, &exit_code] { exit_code = workbench::run_comparison(*options); });
}

}  // namespace loopwarden::lab
