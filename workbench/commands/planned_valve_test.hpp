// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::workbench {

struct PlannedTestOptions {
  std::string plan;    // next_test.yaml
  std::string target;  // model, or tag with `live`; empty: that of the plan
  std::string socket;
  std::string record;  // of a move that a person made; a folder: the recorder's segments
  bool live = false;
  std::string out;
  std::string survey;  // empty: not kept there
  bool json = false;
};

// Carries out the test of a plan, judges it together with the record of the planning, and writes
// test.csv, test.json and report.html. With `record`, it finds the move there. Returns the exit
// code. Throws CommandError.
int run_planned_test(const PlannedTestOptions& options);

}  // namespace loopwarden::workbench
