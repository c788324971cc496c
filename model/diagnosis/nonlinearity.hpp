// SPDX-License-Identifier: Apache-2.0
// The nonlinearity of an oscillation. Of loops that swing together, the source has the largest,
// because each process between it and the others filters. Equations: docs/math/neighbours.md.
//
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
