// SPDX-License-Identifier: Apache-2.0
// Compares the valve compensators in tables, JSON, and a page with pictures.
#pragma once

#include <string>

#include "workbench/command_line/command.hpp"
#include "workbench/compare/compare_cases.hpp"

namespace loopwarden::workbench {

struct ComparisonOptions {
  std::string model;
  std::string out;
  double estimate = 0.8;
  bool json = false;
  ComparedPlants plants = ComparedPlants::own;
};

void add_comparison_options(Command& command, ComparisonOptions& options);

// Returns the exit code.
int run_comparison(const ComparisonOptions& options);

}  // namespace loopwarden::workbench
