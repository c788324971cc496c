// SPDX-License-Identifier: Apache-2.0
// Trains the team of specialists on windows of the simulated loop.
//
// The specialists' networks learn together: least cross-entropy of their softmax, by Adam on small
// batches, with weight decay, stopped by the validation windows. Of several restarts, the one with
// the least validation error is used. The temperature is then fitted to the validation windows.
//
// The same model, settings and seed give the same bits, whatever the number of threads.
//
// No errors if every condition has examples.
// Limits: the networks can't recognise effects that the windows never show.
//
// Source: D. Kingma and J. Ba, Proc. ICLR (2015).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "model/numeric/parallel.hpp"
#include "model/specialist/train/simulated_windows.hpp"
#include "model/specialist/judge/team.hpp"

namespace loopwarden::specialist {

using numeric::ParallelFor;

struct TeamTrainingSettings {
  std::uint64_t seed = 1;
  std::size_t windows = 16000;  // a tenth of them validates
  std::size_t hidden = 16;      // neurons of each hidden layer
  std::size_t restarts = 2;
  std::size_t most_epochs = 60;
  std::size_t patience = 8;  // epochs without a better validation error
};

struct Example {
  NetworkInputs inputs{};
  Condition condition = Condition::no_fault;
  double log_misfit = 0.0;  // log of the error of its own condition's model over the noise
};

struct TeamEpoch {
  std::size_t restart = 0;
  std::size_t epoch = 0;
  double training = 0.0;  // cross-entropy, nats
  double validation = 0.0;
};

// One finished restart. A caller may store it and continue from it after an interruption.
struct TeamRestart {
  std::array<Network, kConditions> networks;
  std::vector<TeamEpoch> epochs;
  double validation = 0.0;
};

struct TeamHooks {
  std::function<std::optional<TeamRestart>(std::size_t restart)> find;  // a restart from before
  std::function<void(std::size_t restart, const TeamRestart&)> finished;
  std::function<void(const TeamEpoch&)> epoch;  // from the threads that train
};

struct TeamTraining {
  Team team;
  std::vector<TeamEpoch> epochs;
  double validation = 0.0;  // cross-entropy after the temperature, nats
};

// Simulates examples k = first to first + count - 1 from `seed`; the same k gives the same example.
// The conditions take turns, with no_fault twice as often as each of the others. Unusable windows
// are drawn again.
std::vector<Example> simulate_examples(const plant::LoopModel& model, std::size_t count,
                                       std::uint64_t seed, const ParallelFor& parallel_for,
                                       std::size_t first = 0);

TeamTraining train_team(const LoopFacts& facts, const std::vector<Example>& examples,
                        const TeamTrainingSettings& settings, const ParallelFor& parallel_for,
                        const TeamHooks& hooks = {});

// Returns the seed of example k: independent streams from one seed.
std::uint64_t stream_seed(std::uint64_t seed, std::uint64_t k) noexcept;

}  // namespace loopwarden::specialist
