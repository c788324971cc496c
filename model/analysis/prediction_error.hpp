// SPDX-License-Identifier: Apache-2.0
// Least squares of the prediction errors of a process model with a noise model.
//
//   y = K g(u; T1, T2, L) + y0 + x0 s(t) + v,   C(q) e = D(q) v     e  prediction error
//
//   g   response of the process with unit gain to u - u(0), sampled exactly for u held over each
//       period
//   s   decay of the initial state: exp(-t/T1), with two lags also exp(-t/T2), and the effect of
//       another CO before the first sample; integrating: t. Each has a separate x0
//   C, D = 1 + c1 q^-1 + ... + cn q^-n, of the same order n. 0: white noise; 1: a wandering
//       disturbance plus white noise; more: disturbances that pass the process. They are kept
//       stable by their reflection coefficients
//
// K, y0, x0 are solved for at every step (variable projection). ln T1, ln T2, L and the noise model
// are found by the bounded least squares of model/numeric. At a missing y, e is 0. The method is
// valid in open and closed loop if the noise model can describe the disturbance; u may depend on
// past y in any way.
//
// Intervals are profile likelihood intervals. For each value all other parameters are fitted again.
// The value is within the 95 % interval if the sum of squares is then at most 3.84 s^2 above the
// least sum, s^2 = sum/(N - parameters). Intervals can be asymmetric. An end is infinite if the
// record sets no limit.
//
// Errors: no exceptions.
// Limits: it can't determine whether u has moves other than those by the disturbance
// (excitation.hpp).
//
// Sources: Ljung, System Identification (1999), ch. 3, 4, 13; Golub and Pereyra, SIAM J. Numer.
// Anal. 10 (1973) (variable projection); Hannan and Rissanen, Biometrika 69 (1982) (start of the
// noise model); Bates and Watts, Nonlinear Regression (1988), ch. 6 (profiles).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/plant/process.hpp"

namespace loopwarden::analysis {

// A value with its interval.
struct Estimate {
  double value = 0.0;
  double low = 0.0;  // 95 % interval
  double high = 0.0;
};

enum class ProcessForm : std::uint8_t { one_lag, two_lags, integrating, integrating_lag };
const char* to_text(ProcessForm form) noexcept;
constexpr bool is_integrating(ProcessForm form) noexcept {
  return form == ProcessForm::integrating || form == ProcessForm::integrating_lag;
}

// The samples of a fit.
struct Samples {
  std::vector<double> u;  // CO units, minus its first value, without gaps
  std::vector<double> y;  // PV units, minus its mean; NaN is missing
  double period_s = 1.0;
  std::size_t used = 0;  // number of y that are not missing

  std::size_t size() const noexcept { return u.size(); }
  double length_s() const noexcept { return static_cast<double>(size()) * period_s; }
};

// Largest number of columns for a start away from rest.
inline constexpr std::size_t kMostStarts = 3;

struct NoiseModel {
  // atanh of the reflection coefficients of D and C.
  std::vector<double> d;
  std::vector<double> c;

  std::size_t order() const noexcept { return d.size(); }
};

struct PredictionFit {
  ProcessForm form = ProcessForm::one_lag;
  double gain = 0.0;
  double time_constant_s = 0.0;  // T1; 0 if integrating
  double second_lag_s = 0.0;     // T2; 0: no second lag
  double dead_time_s = 0.0;
  double level = 0.0;                       // y0
  std::array<double, kMostStarts> start{};  // one x0 per column
  NoiseModel noise;
  double sum_squares = 0.0;  // of e
  double criterion = 0.0;    // Bayesian information criterion; the smaller the better

  std::size_t parameters() const noexcept;
};

// Returns a first fit: the best of a grid of time constants and dead times with three noise models,
// then least squares with noise of order 1.
PredictionFit start_fit(const Samples& samples, bool integrating);
// Returns `from` after least squares with its form and noise order.
PredictionFit refined(const Samples& samples, const PredictionFit& from);
// Returns `from` with a noise model of another order, which starts from the residuals of `from`,
// refined.
PredictionFit with_noise_order(const Samples& samples, const PredictionFit& from,
                               std::size_t order);
// Returns `from` with a second lag, refined from several starts.
PredictionFit with_second_lag(const Samples& samples, const PredictionFit& from);

struct Intervals {
  Estimate gain, time_constant_s, second_lag_s, dead_time_s;
};
// Returns intervals from the curvature at the fit: fast, for forms that are only compared.
Intervals curvature_intervals(const Samples& samples, const PredictionFit& fit);
// Returns profile likelihood intervals. If a profile finds a better fit, it replaces `fit`.
Intervals profile_intervals(const Samples& samples, PredictionFit& fit);

// Returns the standard error of the gain if only `u` (as Samples::u) had moved the process, with
// the noise of `fit`.
double gain_error_under(const Samples& samples, const PredictionFit& fit,
                        const std::vector<double>& u);

// Returns PV minus its mean from the process of the fit, without the noise model.
std::vector<double> free_run(const Samples& samples, const PredictionFit& fit);
// Returns the innovations e.
std::vector<double> innovations(const Samples& samples, const PredictionFit& fit);

}  // namespace loopwarden::analysis
