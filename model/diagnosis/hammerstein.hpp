// SPDX-License-Identifier: Apache-2.0
// Hammerstein evidence: is PV foretold better from a CO that went through a sticking valve?
//
//   PV(k) = a1 PV(k-1) + a2 PV(k-2) + a3 PV(k-3) + b1 v(k-1-d) + b2 v(k-2-d) + c + c1 k,   d 0 to 8
//   v = CO                                             linear
//   v = play(CO, s) or stiction(CO, s, j = s/2)        valve, s 0.1 to 0.95 of the range of CO from 2 to 98 %
//   g_i = log(RSS linear / RSS valve) in part i of eight parts of the record, within -0.5 to 1
//   A = mean of g_i, at the block length at which it is largest: 1, 2, 4, ... samples averaged, 100 blocks at the least
//
// Weighted least squares of one step ahead: each part of the record weighs alike (by what its own past leaves unexplained there),
// so that one upset or one large set-point step can neither make the evidence nor drown it. PV's own past is the noise model: in
// a closed loop CO echoes PV through the controller, and without it a load looks like a valve. For the same reason v
// enters a block late at the least: within a block CO holds PV's value already, which makes the linear model foretell what it
// has been told. Short blocks see fast processes, long ones average noise away.
//
// A valve that counts reverses twice at the least, and its gain has the sign that the controller's action asks for: else the loop
// would run away.
//
// Source: R. Srinivasan, R. Rengaswamy, S. Narasimhan and R. Miller, Ind. Eng. Chem. Res. 44 (2005); M. Jelali,
// J. Process Control 18 (2008), with ARX in place of ARMAX and a grid in place of a global search.
//
// Limits: it can't see a band smaller than the noise of CO, or a jump that the sampling hides.
#pragma once

#include <cstddef>
#include <span>

#include "model/diagnosis/series.hpp"

namespace loopwarden::diagnosis {

struct Hammerstein {
  double evidence = 0.0;      // A
  double parts_for = 0.0;     // share of the parts with g above 0, 0 to 1
  double band = 0.0;          // CO units, s of the best valve
  double band_share = 0.0;    // of the range of CO
  bool jumps = false;         // stiction with a jump better than play
  std::size_t block = 0;      // samples averaged into one; 0 where nothing could be fitted
  std::size_t dead_time = 0;  // blocks, of the best valve
  std::size_t reversals = 0;  // of the best valve
};

// `action` as in ControllerFit, 0 where it isn't known.
Hammerstein fit_hammerstein(std::span<const double> pv, std::span<const double> co,
                            double action = 0.0);

}  // namespace loopwarden::diagnosis
