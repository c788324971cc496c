// SPDX-License-Identifier: Apache-2.0
// How much of what PV varies a better controller could take away, from routine data and a dead time.
//
//   y(k) = a1 y(k - b) + ... + am y(k - b - m + 1) + r(k)      by least squares
//   variability = 1 - var(r) / var(y)                          0 to 1
//
// y: PV - SP, or PV about its mean where there is no SP; b: dead time, samples. What could be foretold b samples ahead
// could have been corrected: 0 is a controller of minimum variance, 1 one whose whole error was foreseeable.
//
// No errors. Fewer than 10 (b + m) samples, or a y that does not vary, give NaN.
// Sources: T. J. Harris, Can. J. Chem. Eng. 67 (1989); L. Desborough and T. Harris, Can. J. Chem. Eng. 70 (1992).
// Limits: it can't say that a controller of this structure could do it, or that it ought to: a tank that is meant to
// buffer has an index near 1. The dead time is an estimate; twice the dead time takes a few hundredths off.
#pragma once

#include <cstddef>
#include <span>

namespace loopwarden::survey {

inline constexpr std::size_t kVariabilityOrder = 20;

// NaN in y: a missing sample; rows that touch one are left out.
double variability(std::span<const double> y, std::size_t dead_time_samples);

// Samples from a move of CO to the first answer of PV: the lag up to `most` at which changes of PV go along most with
// changes of CO, less the time over which they go along at half of that. At least 1.
std::size_t dead_time_samples(std::span<const double> co, std::span<const double> pv,
                              std::size_t most);

}  // namespace loopwarden::survey
