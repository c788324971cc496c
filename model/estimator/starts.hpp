// SPDX-License-Identifier: Apache-2.0
// Start values from statistics of the record.
//
// CO is measured, so the error of the model's free run is the disturbance itself, plus what an
// effect makes of CO. A grid of least-squares fits to this error finds the moment of a step, the
// frequency of a sine and the period and phase of a square wave, which a population of some dozen
// members would find only by chance.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "model/estimator/blocks.hpp"
#include "model/estimator/error_filter.hpp"
#include "model/estimator/hypothesis.hpp"
#include "model/estimator/slips.hpp"

namespace loopwarden::estimator {

// Positions, 0 to 1, of the searched parameters of a disturbance for which its columns and a
// constant leave least of `error` (one value per block, PV units). None if the effect has no
// columns or more than two searched parameters. `filter`: if not null, its innovations count, which
// a slow error does not hide.
std::optional<std::vector<double>> scan(const Candidate& candidate, const Blocks& blocks,
                                        std::span<const double> error,
                                        const ErrorFilter* filter = nullptr);

// Positions of the searched parameters of stiction from the slips that PV shows. None if there are
// fewer than three.
std::optional<std::vector<double>> sticking_start(const Candidate& candidate, const Slips& slips);

}  // namespace loopwarden::estimator
