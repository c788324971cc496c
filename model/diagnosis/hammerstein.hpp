// SPDX-License-Identifier: Apache-2.0
// Hammerstein evidence: measures whether a CO that passed through a sticking valve predicts PV
// better.
//
//   PV(k) = a1 PV(k-1) + a2 PV(k-2) + a3 PV(k-3) + b1 v(k-1-d) + b2 v(k-2-d) + c + c1 k,   d 0 to 8
//   v = CO                                             linear
//   v = play(CO, s) or stiction(CO, s, j = s/2)        valve
//       s 0.1 to 0.95 of the range of CO from 2 to 98 %
//   g_i = log(RSS linear / RSS valve) in part i of eight parts of the record, within -0.5 to 1
//   A = mean of g_i, at the block length at which it is largest
//       1, 2, 4, ... samples averaged, at least 100 blocks
//
// Weighted least squares of one step ahead. Each part of the record has the same weight, by the
// variance that its own past leaves unexplained. So one upset or one large set-point step can
// neither create nor hide the evidence. PV's own past is the noise model: in a closed loop CO
// echoes PV through the controller, and without this model a load looks like a valve. For the same
// reason v enters at least one block late: within a block CO contains PV's value already, so the
// linear model would predict a value that is among its inputs. Short blocks show fast processes,
// long ones average noise away.
//
// A valve counts only if it reverses at least twice, and if its gain has the sign that the
// controller's action requires: otherwise the loop would run away.
//
// Source: R. Srinivasan, R. Rengaswamy, S. Narasimhan and R. Miller, Ind. Eng. Chem. Res. 44
// (2005); M. Jelali, J. Process Control 18 (2008), with ARX in place of ARMAX and a grid in place
// of a global search.
//
// Limits: it can't see a band smaller than the noise of CO, or a jump that the sampling hides.
#pragma once

#include <cstddef>
#include <span>

#include "model/diagnosis/series_ops.hpp"

namespace loopwarden::diagnosis {

struct Hammerstein {
  double evidence = 0.0;      // A
  double parts_for = 0.0;     // share of the parts with g above 0, 0 to 1
  double band = 0.0;          // CO units, s of the best valve
  double band_share = 0.0;    // of the range of CO
  bool jumps = false;         // stiction with a jump better than play
  std::size_t block = 0;      // samples averaged into one; 0 without a fit
  std::size_t dead_time = 0;  // blocks, of the best valve
  std::size_t reversals = 0;  // of the best valve
};

// Returns the evidence. `action` as in ControllerFit, 0 if unknown.
Hammerstein fit_hammerstein(std::span<const double> pv, std::span<const double> co,
                            double action = 0.0);

}  // namespace loopwarden::diagnosis
