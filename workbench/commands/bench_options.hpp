// SPDX-License-Identifier: Apache-2.0
// Selects the loop of valve-test and autotune: a model, or a loop of the running daemon with
// limits.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "workbench/command_line/command.hpp"
#include "workbench/live/test_bench.hpp"

namespace loopwarden::workbench {

struct BenchOptions {
  std::string target;  // model file, or the loop's tag with --live
  std::string socket;
  bool live = false;
  std::optional<double> low, high;        // CO units
  std::optional<double> pv_low, pv_high;  // PV units
};

// Adds all but the target.
void add_bench_options(Command& command, BenchOptions& options);

// Throws CommandError if a lower limit is not below its upper one, or if a live test has no limits.
void check_limits(const BenchOptions& options);

// Throws CommandError if the model is not usable, TestAborted if the loop is not.
std::unique_ptr<TestBench> bench_of(const BenchOptions& options);

}  // namespace loopwarden::workbench
