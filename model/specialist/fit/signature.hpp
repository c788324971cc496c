// SPDX-License-Identifier: Apache-2.0
// A flow signature as the thesis has it: 961 samples of PV from a set-point step on, read column by
// column into a 31 x 31 matrix, and scaled to about -1 to 1.
//
//   x(r, c) = (PV(31 c + r) - centre) / half_span
//
//   PV, centre, half_span  PV units, half_span > 0
//
// Limits: it needs signatures that begin at the step. One that begins elsewhere is another
// signature.
//
// Source: Sewdass, thesis (Durban University of Technology), section 8.3, figure 8.2.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::specialist {

inline constexpr std::size_t kSide = 31;
inline constexpr std::size_t kSignatureSamples = kSide * kSide;

using SignatureMatrix = Eigen::Matrix<double, static_cast<int>(kSide), static_cast<int>(kSide)>;

struct Scaling {
  double centre = 0.0;     // PV units
  double half_span = 1.0;  // PV units, > 0

  friend bool operator==(const Scaling&, const Scaling&) = default;
};

// Returns the scaling from the least to the largest of all samples. The least span is 1e-9 of the
// size.
Scaling scaling_of(const std::vector<std::vector<double>>& signatures);

// Returns the matrix of `pv`, which has kSignatureSamples samples.
SignatureMatrix signature_matrix(std::span<const double> pv, const Scaling& scaling) noexcept;

}  // namespace loopwarden::specialist
