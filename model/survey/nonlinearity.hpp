// SPDX-License-Identifier: Apache-2.0
// How much an oscillation owes to something nonlinear: of loops that swing together the source has the most, as each
// process between it and the others filters.
//
//   embed    y in rows of kEmbedding samples, about kSamplesPerCycle samples a cycle
//   foretell y kHorizon ahead of each row as the mean of what followed its kNeighbours nearest rows; Gamma: mean square error
//   compare  with the same for kSurrogates series of the same spectrum and random phases
//   N        (mean of the surrogates' Gamma - Gamma) / (3 their standard deviation); above 1: nonlinear
//
// Source: N. F. Thornhill, J. Process Control 15 (2005) 833-846.
// No errors. Fewer than four cycles give 0.
// Limits: it can't tell a nonlinear valve from a nonlinear process or sensor; name the loop with certainty.
#pragma once

#include <cstdint>
#include <span>

namespace loopwarden::survey {

// `period`: of the oscillation, samples. Same seed, same bits.
double nonlinearity(std::span<const double> y, double period, std::uint64_t seed);

}  // namespace loopwarden::survey
