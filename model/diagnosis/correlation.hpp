// SPDX-License-Identifier: Apache-2.0
// The relation of CO and PV: the cross-correlation between them, and the controller that connects
// them.
//
//   r(L) = sum error(k + L) output(k) / n, |L| up to half a period, both of standard deviation 1
//
// On a self-regulating process a sticking valve gives a square wave in PV. With an integrating
// controller, CO is a triangle a quarter of a period off: r is odd. A load that oscillates, or
// tight tuning, gives a phase between a quarter and a half period: r tends to even (A. Horch,
// Control Engineering Practice 7, 1999). On an integrating process that does not hold (Horch 2006).
//
// The controller is linear, so its output follows from the error:
//   output(k) - output(k-1) = -gain [ error(k) - error(k-1) + error(k) h / Ti ]
//
// Limits: a set point that moves and is not given makes both results wrong.
#pragma once

#include <span>

namespace loopwarden::diagnosis {

struct CrossCorrelation {
  double at_zero = 0.0;    // r(0) over the largest |r|
  double odd_share = 0.0;  // of the energy of r that is odd in L, 0 to 1
  double strength = 0.0;   // largest |r|
  double phase = 0.0;      // rad in -pi..pi, lag of PV relative to CO at the period
  double coherence = 0.0;  // of the two at the period, 0 to 1, by segments of two periods
};
CrossCorrelation cross_correlation(std::span<const double> error, std::span<const double> output,
                                   double period);

struct ControllerFit {
  double action = 0.0;          // +1: CO falls when PV rises (reverse acting), -1: the other way
  double integral_share = 0.0;  // of the movement of CO that is integral action, 0 to 1
  double fit = 0.0;             // R^2 of CO's differences over an eighth of a period, 0 to 1
};
ControllerFit fit_controller(std::span<const double> error, std::span<const double> output,
                             double period);

}  // namespace loopwarden::diagnosis
