// SPDX-License-Identifier: Apache-2.0
// Trains the specialists of the faithful form: one for each condition of a plant, each grown over
// networks of 10, 20 and 31 neurons a hidden layer, from several starts.
//
// Of the signatures of a condition three fifths train, a fifth validates, a fifth tests, and the one with the
// strongest signature is the target of all. The columns of a signature are the cases; what they shall
// become are the same columns of the target. The next size is tried while the last one lowered the validation
// error by kWorthwhile; the network with the least validation error stays.
//
// With `components` below 31 the columns are first reduced to that many principal components of the
// training columns (thesis, section 9.3), and the first layer takes them over: the network in use
// is an ordinary one on 31 inputs.
//
// Errors: std::invalid_argument where a condition has no signature to train on or to validate by.
// Limits: it can't learn from signatures of another set point, period or plant than those it will judge.
//
// Source: Sewdass, thesis (Durban University of Technology), sections 8.3, 8.4 and 9.3.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "model/specialist/ensemble.hpp"
#include "model/training/levenberg_marquardt.hpp"
#include "model/training/simulated_windows.hpp"

namespace loopwarden::specialist {

inline constexpr double kWorthwhile = 0.05;
inline constexpr std::size_t kSignaturesOfCondition = 25;

enum class Role : std::uint8_t { training, validation, test };
const char* to_text(Role role) noexcept;

struct Signature {
  std::vector<double> pv;  // kSignatureSamples, PV units
  Condition condition = Condition::no_fault;
  double severity_percent = 0.0;  // of the CO span; 0 where unknown
  Role role = Role::training;
  std::vector<double> co{};  // CO units, of simulated ones; the networks do not see it
};

// Roles in the order 3 : 1 : 1, the same whatever the number.
Role role_of(std::size_t place) noexcept;

// The place in `signatures` of a condition's target: the most severe; without severities that farthest from the
// mean of the healthy ones, or of no_fault that nearest to its mean.
std::size_t target_of(const std::vector<Signature>& signatures, Condition condition);

// A step from rest as in the thesis: to `set_point` at 0 s, the model's own PV noise or 0.1 % of span,
// tuning off by up to a tenth, fault of random severity.
Signature simulate_signature(const plant::LoopModel& model, Condition condition,
                             std::uint64_t seed);

struct GrowingSettings {
  std::uint64_t seed = 1;
  std::vector<std::size_t> sizes{10, 20, 31};
  bool all_sizes = false;  // train every size, for a table like 8.1
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
  // Finished before, as `finished` got it.
  std::function<std::optional<Learned>(std::size_t size, std::size_t restart)> find;
  std::function<void(std::size_t size, std::size_t restart, const Learned&)> finished;
  std::function<void(std::size_t size, std::size_t restart, std::size_t epoch, const Epoch&)> epoch;
};

// Of one condition; the scaling is that of the plant. Throws std::invalid_argument if training or validation
// has no signature of it.
Grown grow(const std::vector<Signature>& signatures, Condition condition, const Scaling& scaling,
           const GrowingSettings& settings, const GrowingHooks& hooks = {});

}  // namespace loopwarden::specialist
