// SPDX-License-Identifier: Apache-2.0
// The nonlinearity of an oscillation. Of loops that swing together, the source has the largest,
// because each process between it and the others filters.
//
//   embed    y in rows of kEmbedding samples, about kSamplesPerCycle samples a cycle
//   predict  y kHorizon ahead of each row as the mean of the successors of its kNeighbours nearest
//            rows; Gamma: mean square error
//   compare  with the same for kSurrogates series of the same spectrum and random phases
//   N        (mean of the surrogates' Gamma - Gamma) / (3 their standard deviation); above 1:
//            nonlinear
//
// Source: N. F. Thornhill, J. Process Control 15 (2005) 833-846.
// No errors. Fewer than four cycles give 0.
// Limits: it can't distinguish a nonlinear valve from a nonlinear process or sensor, or name the
// loop with certainty.
#pragma once

#include <cstdint>
#include <span>

namespace loopwarden::diagnosis {

// Returns N. `period`: of the oscillation, samples. Same seed, same bits.
double nonlinearity(std::span<const double> y, double period, std::uint64_t seed);

}  // namespace loopwarden::diagnosis
