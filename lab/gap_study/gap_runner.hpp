// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lab/gap_study/score.hpp"

namespace loopwarden::studies::gap_study {

// What the generator of hidden cases is asked for.
struct CaseOrder {
  std::size_t count = 0;
  std::uint64_t seed = 0;
  std::string kinds;
  std::size_t samples = 0;
  bool load = false;
};

// Has the program make the cases under `folder`. Throws std::invalid_argument where it refuses the order,
// std::system_error where it can't be started or fails.
void make_cases(const std::filesystem::path& generator, const CaseOrder& order,
                const std::filesystem::path& folder);

struct CaseFiles {
  Truth truth;
  std::filesystem::path folder;
};

// The cases of a folder with a truth.json, or the one case whose truth stands in the folder above.
// Throws std::system_error where there is neither, std::runtime_error for a bad truth.json.
std::vector<CaseFiles> find_cases(const std::filesystem::path& folder);

struct GapProgram {
  std::filesystem::path path;
  double time_limit_s = 120.0;
  std::vector<std::string> options{};  // passed on behind the others
  bool without_truth = false;          // the catalogue without the names that would be right
  bool resume = false;                 // a gap.json that is there already is taken, not made again
};

// PATH gap CASE/record.csv --model CASE/model.yaml --out OUT --json [options], its processor time taken, then
// OUT/gap.json.
// Whatever the program does is an answer; throws std::system_error only where it can't be started.
Answer run_gap(const GapProgram& program, const std::filesystem::path& one_case,
               const std::filesystem::path& out);

// All cases, `jobs` at a time, each with a folder of its own under `out`; in the order of `cases`.
// `progress(done)` is called on any thread, one at a time.
std::vector<ScoredCase> run_cases(const GapProgram& program, const std::vector<CaseFiles>& cases,
                                  const std::filesystem::path& out, unsigned jobs,
                                  const std::function<void(std::size_t)>& progress);

}  // namespace loopwarden::studies::gap_study
