// SPDX-License-Identifier: Apache-2.0
// Describing functions of backlash and stiction: the first harmonic of the valve's output over its
// sinusoidal input of amplitude a.
//
//   backlash of dead band d, a > d/2 (thesis, equation 3.1, its d taken as the whole dead band):
//     Re N = (1/pi) ( pi/2 + arcsin(1 - d/a) + (1 - d/a) sqrt((d/a)(2 - d/a)) )
//     Im N = -(1/pi) (d/a) (2 - d/a)
//
//   stiction with S and J in Choudhury's sense, a > S/2 (thesis, equations 3.2 to 3.5):
//     N   = -(1/(pi a)) (A - j B)
//     A   = (a/2) sin 2p - 2 a cos p - a (pi/2 + p) + 2 (S - J) cos p
//     B   = -(3/2) a + (a/2) cos 2p + 2 a sin p - 2 (S - J) sin p
//     p   = arcsin((a - S)/a)
//
//   a, d, S, J  CO units     Both are 0 below the least amplitude, because the valve doesn't move.
//
// Stiction with J = 0 is backlash with d = S, and the two formulas agree. For J > S the law
// overshoots, and the formula is still valid.
// Limits: one sinusoid at the input of the valve. With PI control and a sticking valve, CO is more
// like a triangle; `loopwarden limit-cycle --grid` prints the resulting error.
//
// Sources: Gelb and Vander Velde, Multiple-Input Describing Functions (1968), appendix B
// (backlash); Choudhury, Thornhill and Shah, Control Engineering Practice 13 (2005) 641-658
// (stiction).
#pragma once

#include <complex>

namespace loopwarden::analysis {

// Return N for the dead band or for S and J, and the amplitude a, all in CO units.
std::complex<double> backlash_describing_function(double deadband, double amplitude);
std::complex<double> stiction_describing_function(double s, double j, double amplitude);

}  // namespace loopwarden::analysis
