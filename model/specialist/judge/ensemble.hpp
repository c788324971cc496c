// SPDX-License-Identifier: Apache-2.0
// The ensemble of the thesis. Each specialist redraws a signature as its fault's target signature.
// The verdict is that of the specialist with the lowest mean square error, however large the error
// is.
//
//   mse_i = mean over the 961 samples of (net_i(x) half_span + centre - target_i)^2
//   verdict = argmin mse_i
//
//   mse  (PV units)^2
//
// Inference in single precision, all 31 columns at once, no allocation; the same bits with and
// without AVX2.
//
// No errors; a signature with a missing sample has non-finite errors and no verdict.
// Limits: it has no verdict "unknown". It judges only windows that begin with the step, and only
// the set points, step sizes and loops of its training. team.hpp doesn't have these limits.
//
// Source: Sewdass, thesis (Durban University of Technology), equations 8.1 to 8.8.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "model/specialist/judge/classes.hpp"
#include "model/specialist/judge/network.hpp"
#include "model/specialist/fit/signature.hpp"

namespace loopwarden::specialist {

struct SignatureSpecialist {
  std::string name;  // P1S10
  Condition condition = Condition::no_fault;
  Network network;  // 31-h-h-31, of scaled columns
  Scaling scaling;
  std::vector<double> target;  // kSignatureSamples, PV units
};

class SignatureEnsemble {
 public:
  explicit SignatureEnsemble(const std::vector<SignatureSpecialist>& specialists);

  std::size_t size() const noexcept { return specialists_.size(); }
  // Returns the error of each specialist, in their order. The result is valid until the next call.
  std::span<const double> errors(std::span<const double> pv) noexcept;
  // Returns the index of the lowest error; empty if no error is finite.
  std::optional<std::size_t> verdict(std::span<const double> pv) noexcept;

 private:
  static constexpr std::size_t kColumns = 32;  // the 31, plus one for alignment
  struct CompiledLayer {
    std::size_t inputs = 0;
    std::size_t outputs = 0;
    std::vector<float> weights;  // row by row
    std::vector<float> bias;
  };
  struct Compiled {
    std::array<CompiledLayer, 3> layers;
    Scaling scaling;
    std::vector<float> target;  // scaled, rows of kColumns
  };

  std::vector<Compiled> specialists_;
  std::array<std::vector<float>, 4> activity_;  // rows of kColumns
  std::vector<double> errors_;
};

}  // namespace loopwarden::specialist
