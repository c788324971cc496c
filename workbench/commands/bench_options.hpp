// SPDX-License-Identifier: Apache-2.0
// Where valve-test and autotune work: on a model, or on a loop of the running daemon within limits.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <optional>
#include <string>

#include "workbench/live/test_bench.hpp"

namespace loopwarden::workbench {

struct BenchOptions {
  std::string target;  // model file, or the loop's tag with --live
  std::string socket;
  bool live = false;
  std::optional<double> low, high;        // CO units
  std::optional<double> pv_low, pv_high;  // PV units
};

void add_bench_options(CLI::App& sub, BenchOptions& options);

// Prints what is wrong with them.
bool limits_make_sense(const BenchOptions& options);

// Null where the model is none; that has been printed. Throws TestAborted.
std::unique_ptr<TestBench> bench_of(const BenchOptions& options);

}  // namespace loopwarden::workbench
