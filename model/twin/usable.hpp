// SPDX-License-Identifier: Apache-2.0
// Can a loop be commissioned from this record at all? Gates that ask nothing of any model.
//
//   compressed   an archive is recognised (analysis/archive.hpp) that kept less than kLeastStored of the samples of PV,
//                or kMostStill of them repeat the one before while the changes between are of many sizes (a held
//                measurement): what the valve does between them is gone. A PV whose changes are all its one step is
//                rounded, not compressed
//   manual       no controller moved CO in more than kMostByHand of the samples
//   clamped      CO stands at an end of its range in more than kMostClamped of the samples: the loop is open there
//   still        SP (by hand: CO) moves less often than kFewestMoves, or by less than kLeastMove of its span
//   short        less than kShortest_s
//
//   spans  units of their columns     shares  of 1
//
// Errors: none: what is wrong is the result.
// What it can't do: tell a compression whose deviation is below the noise; nothing is lost to it
// then.
//
// Source: Thornhill, Choudhury and Shah, J. Process Control 14 (2004) 389-398 (compression, and the
// second difference that shows it). The shares are our choice.
#pragma once

#include <string>
#include <vector>

#include "model/gap/record.hpp"

namespace loopwarden::twin {

inline constexpr double kShortest_s = 1200.0;
inline constexpr double kLeastStored = 0.5;
inline constexpr double kMostStill = 0.8;
inline constexpr double kMostByHand = 0.2;
inline constexpr double kMostClamped = 0.1;
inline constexpr double kLeastMove = 0.01;  // of the span
inline constexpr int kFewestMoves = 2;

struct Spans {
  double co_low = 0.0, co_high = 100.0;  // CO units
  double pv_low = 0.0, pv_high = 100.0;  // PV units
};

// Each a sentence that says why; empty where the record passes.
std::string why_compressed(const numeric::LoopRecord& record);
std::string why_by_hand(
    const std::vector<double>& automatic);  // 1, 0, NaN: not known; may be empty
std::string why_clamped(const numeric::LoopRecord& record, const Spans& spans);
std::string why_still(const numeric::LoopRecord& record, const Spans& spans);
std::string why_short(const numeric::LoopRecord& record);

}  // namespace loopwarden::twin
