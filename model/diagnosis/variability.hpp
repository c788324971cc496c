// SPDX-License-Identifier: Apache-2.0
// The share of PV's variation that a better controller could remove, from routine data and a dead
// time.
//
//   y(k) = a1 y(k - b) + ... + am y(k - b - m + 1) + r(k)      by least squares
//   variability = 1 - var(r) / var(y)                          0 to 1
//
// y: PV - SP, or PV about its mean without SP; b: dead time, samples. A controller could have
// corrected an error that is predictable b samples ahead. 0 is a controller of minimum variance, 1
// one whose whole error was predictable.
//
// No errors. Fewer than 10 (b + m) samples, or a y that does not vary, give NaN.
// Sources: T. J. Harris, Can. J. Chem. Eng. 67 (1989); L. Desborough and T. Harris, Can. J. Chem.
// Eng. 70 (1992).
// Limits: it can't show that a controller of this structure could do it, or that it ought to: a
// buffer tank has an index near 1. The dead time is an estimate; twice the dead time lowers the
// index by a few hundredths.
#pragma once

#include <cstddef>
#include <span>

namespace loopwarden::diagnosis {

// Returns the index. NaN in y: a missing sample; rows that include one are left out.
double variability(std::span<const double> y, std::size_t dead_time_samples);

// Returns the samples from a move of CO to the first answer of PV: the lag up to `most` with the
// largest correlation of changes of PV and CO, less the time over which it is at least half of
// that. At least 1.
std::size_t dead_time_samples(std::span<const double> co, std::span<const double> pv,
                              std::size_t most);

}  // namespace loopwarden::diagnosis
