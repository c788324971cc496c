// SPDX-License-Identifier: Apache-2.0
// The time scale of a loop's movement.
//
//   P = 4 x first zero of the autocorrelation of CO or of PV, straight line removed, the smaller of
//       the two; moved to the next peak of that autocorrelation if the peak is above 0.15
//
// A quarter period to the first zero is exact for a sine and for a square wave. If the movement
// does not repeat, P is four times its memory.
//
// Limits: it sees one cycle at a time; fast noise as large as the movement shortens P.
#pragma once

#include <span>

namespace loopwarden::diagnosis {

// Returns P in samples, 4 to half the record.
double movement_period(std::span<const double> co, std::span<const double> pv);

}  // namespace loopwarden::diagnosis
