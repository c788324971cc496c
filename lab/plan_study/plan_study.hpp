// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "model/estimator/estimate.hpp"

namespace loopwarden::lab::plan_study {

// A loop with its record and its model, as the estimator takes them.
struct Loop {
  estimator::Observed observed;
  plant::LoopModel model;
  double set_point = 0.0;  // PV units, the last one; the mean of PV if SP is not recorded
};

// Throws std::runtime_error if the model can't be read or the record can't be used.
Loop read_loop(const std::filesystem::path& folder);

inline void one_thread(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

std::string title(const std::vector<std::string>& effects);

// The state of the loop at the end of its record, after its estimate.
estimator::TestStart start_of(const Loop& loop, const estimator::Estimate& estimate);

struct Arguments {
  std::string out;
  std::string kinds = "single,none,pair";
  std::uint64_t seed = 0;
  std::size_t count = 10;
  std::size_t samples = 900;
  std::size_t fixed = 0;
  bool load = false;
};

// Plans and carries out tests on hidden cases; appends one line of JSON per case to `out`.
int study_cases(const Arguments& arguments);
// Prints one table of such files.
int print_table(const std::vector<std::string>& files, bool list);

// Prints predicted against observed log Bayes factors of natural moves.
int study_measured(const std::vector<std::string>& folders);

}  // namespace loopwarden::lab::plan_study
