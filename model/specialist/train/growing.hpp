// SPDX-License-Identifier: Apache-2.0
// Trains the specialists of the thesis's ensemble: one per condition of a plant. Each grows over
// networks of 10, 20 and 31 neurons per hidden layer, from several starts.
//
// Three fifths of a condition's signatures train, a fifth validates, a fifth tests. The strongest
// signature is the target of all. The columns of a signature are the cases; the same columns of the
// target are their desired outputs. The next size is tried if the last one lowered the validation
// error by kWorthwhile. The network with the least validation error is used.
//
// With `components` below 31 the columns are first reduced to that many principal components of the
// training columns (thesis, section 9.3). The first layer includes this reduction, so the final
// network is an ordinary one with 31 inputs.
//
// Errors: std::invalid_argument if a condition has no signature for training or validation.
// Limits: the signatures must have the set point, period and plant of those to be judged.
//
// Source: Sewdass, thesis (Durban University of Technology), sections 8.3, 8.4 and 9.3.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "model/specialist/judge/ensemble.hpp"
#include "model/specialist/train/levenberg_marquardt.hpp"
#include "model/specialist/train/simulated_windows.hpp"

namespace loopwarden::specialist {

enum class Role : std::uint8_t { training, validation, test };
const char* to_text(Role role) noexcept;

struct Signature {
  std::vector<double> pv;  // kSignatureSamples, PV units
  Condition condition = Condition::no_fault;
  double severity_percent = 0.0;  // of the CO span; 0 if unknown
  Role role = Role::training;
  std::vector<double> co{};  // CO units, of simulated ones; no input of the networks
};

// Returns the role: in the order 3 : 1 : 1, whatever the number of signatures.
Role role_of(std::size_t place) noexcept;

// Returns the index of a condition's target in `signatures`: the most severe one. Without
// severities, it is the one farthest from the mean of the healthy ones; for no_fault, the one
// nearest to that mean.
std::size_t target_of(const std::vector<Signature>& signatures, Condition condition);

// Simulates a step from rest as in the thesis: to `set_point` at 0 s, with the model's own PV noise
// or 0.1 % of span, tuning off by up to a tenth, and a fault of random severity.
Signature simulate_signature(const plant::LoopModel& model, Condition condition,
                             std::uint64_t seed);

struct GrowingSettings {
  std::uint64_t seed = 1;
  std::vector<std::size_t> sizes{10, 20, 31};
  std::size_t restarts = 1;
  std::size_t components = kSide;  // 1 to 31
  LearningSettings learning;
};

struct GrownSize {
  std::size_t size = 0;
  Learned learned;
};

struct Grown {
  SignatureSpecialist specialist;  // without a name
  std::vector<GrownSize> sizes;    // the best restart of each
  std::size_t chosen = 0;          // among them
};

struct GrowingHooks {
  // Returns a result from before, as passed to `finished`.
  std::function<std::optional<Learned>(std::size_t size, std::size_t restart)> find;
  std::function<void(std::size_t size, std::size_t restart, const Learned&)> finished;
  std::function<void(std::size_t size, std::size_t restart, std::size_t epoch, const Epoch&)> epoch;
};

// Trains the specialist of one condition; the scaling is that of the plant. Throws
// std::invalid_argument if training or validation has no signature of it.
Grown grow(const std::vector<Signature>& signatures, Condition condition, const Scaling& scaling,
           const GrowingSettings& settings, const GrowingHooks& hooks = {});

}  // namespace loopwarden::specialist
