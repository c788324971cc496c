// SPDX-License-Identifier: Apache-2.0
// Hammerstein evidence: measures whether a CO that passed through a sticking valve predicts PV
// better. Equations and sources: docs/math/valve-evidence.md.
//
// Limits: it can't see a band smaller than the noise of CO, or a jump that the sampling hides.
#pragma once

#include <cstddef>
#include <span>

#include "model/diagnosis/series_ops.hpp"

namespace loopwarden::diagnosis {

struct Hammerstein {
  double evidence = 0.0;      // A
  double parts_for = 0.0;     // share of the parts with g above 0, 0 to 1
  double band = 0.0;          // CO units, s of the best valve
  double band_share = 0.0;    // of the range of CO
  bool jumps = false;         // stiction with a jump better than play
  std::size_t block = 0;      // samples averaged into one; 0 without a fit
  std::size_t dead_time = 0;  // blocks, of the best valve
  std::size_t reversals = 0;  // of the best valve
};

// Returns the evidence. `action` as in ControllerFit, 0 if unknown.
Hammerstein fit_hammerstein(std::span<const double> pv, std::span<const double> co,
                            double action = 0.0);

}  // namespace loopwarden::diagnosis
