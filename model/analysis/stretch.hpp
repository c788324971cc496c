// SPDX-License-Identifier: Apache-2.0
// Which part of a long record to look at: where CO and SP move, the controller is in automatic, and nothing is missing.
//
//   score = (standard deviation of CO in a stretch + that of SP, each over that of the whole record)
//           (share of complete samples)^2 (share in automatic)
//
// on means of 16 samples, so that noise is no movement. Where CO is not known PV stands for it.
// Limits: tell a stretch that shows the fault from one that moves more.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::analysis {

// Columns of one length, NaN where a sample is missing; `co`, `sp` and `automatic` (1 yes, 0 no) may be empty.
struct LongRecord {
  std::span<const double> pv, co, sp, automatic;
};

// First samples of the best stretch of `length` in each of `parts` equal parts of the record, in order; parts that have
// nothing to show are left out. A record that is no longer than that gives 0.
std::vector<std::size_t> telling_stretches(const LongRecord& record, std::size_t length,
                                           std::size_t parts);

}  // namespace loopwarden::analysis
