// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lab/gap_study/score.hpp"

namespace loopwarden::lab::gap_study {

// A request to the generator of hidden cases.
struct CaseOrder {
  std::size_t count = 0;
  std::uint64_t seed = 0;
  std::string kinds;
  std::size_t samples = 0;
  bool load = false;
};

// Runs the program that makes the cases under `folder`. Throws std::invalid_argument if it refuses
// the request, std::system_error if it can't be started or fails.
void make_cases(const std::filesystem::path& generator, const CaseOrder& order,
                const std::filesystem::path& folder);

struct CaseFiles {
  Truth truth;
  std::filesystem::path folder;
};

// Returns the cases of a folder with a truth.json, or the one case whose truth is in the parent
// folder. Throws std::system_error if neither exists, std::runtime_error for an invalid truth.json.
std::vector<CaseFiles> find_cases(const std::filesystem::path& folder);

struct GapProgram {
  std::filesystem::path path;
  double time_limit_s = 120.0;
  std::vector<std::string> options{};  // passed on after the others
  bool without_truth = false;          // the catalogue without the correct names
  bool resume = false;                 // use an existing gap.json instead of a new run
};

// Runs PATH gap CASE/record.csv --model CASE/model.yaml --out OUT --json [options], measures its
// processor time and reads OUT/gap.json. Each result of the program is an answer. Throws
// std::system_error only if the program can't be started.
Answer run_gap(const GapProgram& program, const std::filesystem::path& one_case,
               const std::filesystem::path& out);

// Runs all cases, `jobs` at a time, each with a separate folder under `out`. The result is in the
// order of `cases`. `progress(done)` is called on any thread, one at a time.
std::vector<ScoredCase> run_cases(const GapProgram& program, const std::vector<CaseFiles>& cases,
                                  const std::filesystem::path& out, unsigned jobs,
                                  const std::function<void(std::size_t)>& progress);

}  // namespace loopwarden::lab::gap_study
