// SPDX-License-Identifier: Apache-2.0
// Selects the stretches of a long record to analyse: CO and SP move, the controller is in
// automatic, and no samples are missing.
//
//   score = (standard deviation of CO in a stretch + that of SP, each over that of the record)
//           (share of complete samples)^2 (share in automatic)
//
// The score uses means of 16 samples, so that noise doesn't count as movement. PV replaces an
// unknown CO.
// Limits: it prefers the stretch with more movement, even if another one shows the fault better.
#pragma once

#include <cstddef>
#include <vector>

#include "model/numeric/loop_record.hpp"

namespace loopwarden::analysis {

// Returns the first sample of the best stretch of `length` samples in each of `parts` equal parts
// of the record, in order. CO, SP and `automatic` may be empty. Parts without movement are left
// out. The result is 0 for a record that is not longer than `length`.
std::vector<std::size_t> telling_stretches(const numeric::LoopView& record, std::size_t length,
                                           std::size_t parts);

}  // namespace loopwarden::analysis
