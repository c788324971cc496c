// SPDX-License-Identifier: Apache-2.0
// Hammerstein evidence: is PV foretold better from a CO that went through a sticking valve?
//
//   PV(k) = a1 PV(k-1) + a2 PV(k-2) + a3 PV(k-3) + b1 v(k-1-d) + b2 v(k-2-d) + c + c1 k,   d 0 to 8
//   v = CO                                             linear
//   v = play(CO, s) or stiction(CO, s, j = s/2)        valve, s 0.1 to 0.95 of the range of CO from 2 to 98 %
//   A = mean over blocks of P/10, P/20 and P/40 of log(RSS linear / RSS valve), within -0.15 to 0.4
//
// Least squares of one step ahead. PV's own past is the noise model: in a closed loop CO echoes PV through the controller, and
// without it a load looks like a valve. For the same reason v enters a block late at the least: within a block CO holds
// PV's value already, which makes the linear model foretell what it has been told.
// Above 0.1 speaks for the valve, and names its band; the most specific of the three.
//
// Source: R. Srinivasan, R. Rengaswamy, S. Narasimhan and R. Miller, Ind. Eng. Chem. Res. 44 (2005); M. Jelali,
// J. Process Control 18 (2008), with ARX in place of ARMAX and a grid in place of a global search.
//
// What it can't do: a band smaller than the noise of CO, or fewer than two reversals, change nothing; blocks
// average a jump away that the sampling hides.
#pragma once

#include <span>

#include "model/diagnosis/series.hpp"

namespace loopwarden::diagnosis {

struct Hammerstein {
  double evidence = 0.0;    // A
  double band = 0.0;        // CO units, s of the best valve, median over the blocks
  double jump_share = 0.0;  // of the scales, 0 to 1: stiction with a jump better than play
};

// `period` in samples (movement_period).
Hammerstein fit_hammerstein(std::span<const double> pv, std::span<const double> co, double period);

}  // namespace loopwarden::diagnosis
