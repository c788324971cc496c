// SPDX-License-Identifier: Apache-2.0
// Finds whether a valve with a band slips by a jump (stiction) or follows without one (backlash).
//
//   log odds = log of the mean likelihood of the jumps kJumps, with and without rest after a slip
//            - log of the likelihood without a jump
//
// Equations, symbols and sources: docs/math/band.md. Errors: no exceptions.
// Limits: friction that varies from slip to slip moves the slips away from those of the law.
// Therefore only positive log odds mean something.
#pragma once

#include <array>
#include <span>

#include "model/estimator/band.hpp"

namespace loopwarden::estimator {

struct JumpGrid {
  static constexpr std::array<double, 4> kJumps{0.0, 0.2, 0.5, 0.8};  // of the band
  static constexpr double kLeastBand = 0.6;                           // of the band found
  static constexpr double kMostBand = 1.5;                            // the same
  static constexpr double kBandStep = 1.08;                           // factor
  static constexpr std::array<double, 3> kLags{0.6, 1.0, 1.6};        // factors of the process lag
  static constexpr double kMostNats = 30.0;                           // of one piece, both signs
};

// Returns the log odds, nats, mean over the pieces of the record. `band`: its evidence. 0 if PV or
// CO don't move, or if the stem does not reverse in both cases.
double find_slip_jump(std::span<const double> pv, std::span<const double> co,
                      const BandEvidence& band);

}  // namespace loopwarden::estimator
