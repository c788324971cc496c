// SPDX-License-Identifier: Apache-2.0
// A process model from a record of CO and PV in which CO moved: gain, one or two lags, dead time.
//
//   y(k) = y0 + K g(k; T1[, T2], L)         g  response of the unit-gain process to u - u(first sample)
//
//   first order    T1 g' = u(t - L) - g
//   second order   two such lags in series, T1 >= T2
//
//   y, y0  PV units     u  CO units     K  PV units / CO unit     T1, T2, L  s
//
// Both are sampled exactly for u held over each period, with any fraction of a period in L. Least
// squares on y by Levenberg's method over (y0, K, ln T, L), started from the best of a coarse grid of
// (T, L). The record must begin at rest.
//
// Intervals are of 95 %: +-1.96 sqrt(diag(s^2 (J'J)^-1) (1 + r)/(1 - r)), J the Jacobian at the solution, s^2 the
// residual variance, r the residuals' correlation from one sample to the next, 0 to 0.98.
//
// Errors: IdentificationError says in words why nothing can be identified: no movement of CO, PV that
// does not answer, too few samples.
// What it can't do: self-regulating processes only; a record under closed-loop control gives biased
// figures where a disturbance moves PV, a sticking valve gives too long a dead time and too small a
// gain. The intervals assume that the form of the model is right.
//
// Sources: Ljung, System Identification (1999), ch. 7 and 9; Levenberg, Quart. Appl. Math. 2 (1944).
// Tangent: Ziegler and Nichols (1942); Sewdass, thesis, figure 6.4.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>

#include "model/plant/process.hpp"

namespace loopwarden::analysis {

class IdentificationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Estimate {
  double value = 0.0;
  double margin = 0.0;  // half of the interval of 95 %
};

struct ProcessFit {
  int order = 1;
  Estimate gain;             // PV units / CO unit
  Estimate time_constant_s;  // T1
  Estimate second_lag_s;     // T2; 0 with one lag
  Estimate dead_time_s;      // L
  double rest_pv = 0.0;      // y0
  double rmse = 0.0;         // PV units
  double fit_percent = 0.0;  // 100 (1 - rmse / standard deviation of PV)
  double criterion = 0.0;    // Bayesian information criterion; the smaller the better
};

// `co` and `pv` of one length; NaN in pv: not used, in co: the value before it holds.
ProcessFit identify(std::span<const double> co, std::span<const double> pv, double sample_time_s,
                    int order = 1);

// The tangent at the steepest point of PV after one step of CO. The slope is that of a line through the
// samples of a tenth of the time from 20 to 85 % of the answer, at least three.
//   L  from the step to where the tangent meets the value before
//   T  from there to where it meets the final value
struct Tangent {
  plant::ProcessParameters process;
  double step_time_s = 0.0;  // when CO moved
  double steepest_s = 0.0;   // where the tangent touches
  double slope = 0.0;        // PV units / s
  double before = 0.0;       // PV units
  double final_value = 0.0;  // PV units
};
Tangent tangent_method(std::span<const double> co, std::span<const double> pv,
                       double sample_time_s);

}  // namespace loopwarden::analysis
