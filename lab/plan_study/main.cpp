// SPDX-License-Identifier: Apache-2.0
// Measures the planner of tests (model/estimator/plan.hpp) on foreign plants and measured records.
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "lab/plan_study/plan_study.hpp"

int main(int argc, char** argv) {
  using namespace loopwarden::lab::plan_study;
  CLI::App app("Measures the planner of tests");
  app.require_subcommand(1);
  Arguments arguments;
  std::vector<std::string> inputs;
  bool list = false;
  CLI::App* cases = app.add_subcommand("cases", "Plan and carry out tests on hidden cases");
  cases->add_option("--out", arguments.out, "file to which results are appended")->required();
  cases->add_option("--seed", arguments.seed, "case k has the seed SEED + k")->required();
  cases->add_option("--count", arguments.count, "number of cases")->capture_default_str();
  cases->add_option("--samples", arguments.samples, "rows of a record")->capture_default_str();
  cases->add_option("--kinds", arguments.kinds, "as loopwarden_hidden_cases")
      ->capture_default_str();
  cases->add_option("--fixed", arguments.fixed, "number of fixed tests, 0 to 4")
      ->check(CLI::Range(0, 4))
      ->capture_default_str();
  cases->add_flag("--load", arguments.load, "with an unmeasured random load on PV");
  CLI::App* table = app.add_subcommand("table", "Print one table of the results");
  table->add_option("files", inputs, "files of `cases`")->required();
  table->add_flag("--list", list, "one line per ambiguous case");
  CLI::App* measured =
      app.add_subcommand("measured", "Compare predictions with natural moves of measured records");
  measured->add_option("folders", inputs, "folders with record.csv and model.yaml")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    if (*cases) return study_cases(arguments);
    if (*table) return print_table(inputs, list);
    return study_measured(inputs);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
