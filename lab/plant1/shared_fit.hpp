// SPDX-License-Identifier: Apache-2.0
// Fits several records jointly with one set of shared parameters and one set of own parameters per
// record.
//
//   least  sum over records r of  cost(r, shared, own[r])
//
// Method: differential evolution (Storn and Price, J. Global Optimization 11, 1997) on independent
// islands. A better trial replaces its parent at once. The best member of all islands is the
// result. With given shared parameters the sum separates. A trial therefore tests two sets of own
// parameters for each record, the parent's and a mutated one, and keeps the better. Each island
// runs on one thread with its own stream of random numbers. The result therefore depends on the
// seed and not on the number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace loopwarden::lab {

struct FitBound {
  std::string name;
  double low = 0.0;
  double high = 1.0;  // >= low
};

using FitCost = std::function<double(std::size_t record, std::span<const double> shared,
                                     std::span<const double> own)>;

struct SharedFitProblem {
  std::vector<FitBound> shared;            // may be empty
  std::vector<std::vector<FitBound>> own;  // one list for each record
  FitCost cost;                            // not negative; called from several threads
};

struct SharedFit {
  std::vector<double> shared;
  std::vector<std::vector<double>> own;
  std::vector<double> cost;  // of each record
  double total = 0.0;
};

struct SharedFitWork {
  std::size_t population = 60;  // per island, at least 4
  std::size_t generations = 200;
  std::size_t islands = 1;  // at least 1
  std::uint64_t seed = 1;
  unsigned threads = 1;
  // Receives the number of generations finished on all islands, from one thread at a time; may be
  // empty.
  std::function<void(std::size_t generations)> progress{};
};

// `start`, if given, is added to the first population of each island.
SharedFit fit_shared(const SharedFitProblem& problem, const SharedFitWork& work,
                     const SharedFit* start = nullptr);

}  // namespace loopwarden::lab
