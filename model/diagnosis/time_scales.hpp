// SPDX-License-Identifier: Apache-2.0
// The time scale of a loop's movement, and the three scales for the analysis of its record.
//
//   P = 4 x first zero of the autocorrelation of CO or of PV, straight line removed, the smaller of
//       the two; moved to the next peak of that autocorrelation if the peak is above 0.15
//   scales: straight line removed; less a moving mean over 3 P; less one over 1.2 P
//
// A quarter period to the first zero is exact for a sine and for a square wave. If the movement
// does not repeat, P is four times its memory.
//
// Limits: it sees one cycle at a time; fast noise as large as the movement shortens P.
#pragma once

#include <array>
#include <span>

#include "model/diagnosis/series_ops.hpp"

namespace loopwarden::diagnosis {

// Returns P in samples, 4 to half the record.
double movement_period(std::span<const double> co, std::span<const double> pv);

using TimeScales = std::array<Series, 3>;
TimeScales three_time_scales(std::span<const double> x, double period);

}  // namespace loopwarden::diagnosis
