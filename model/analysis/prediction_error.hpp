// SPDX-License-Identifier: Apache-2.0
// Prediction errors of a process model with a noise model beside it, and their least squares.
//
//   y = K g(u; T1, T2, L) + y0 + x0 s(t) + v,   C(q) e = D(q) v     e  what could not be predicted
//
//   g   response of the process of unit gain to u - u(0), sampled exactly for u held over each period
//   s   decay of the initial state: exp(-t/T1), with two lags also exp(-t/T2), and the effect of
//       another CO before the first sample; integrating: t. Each has its own x0
//   C, D = 1 + c1 q^-1 + ... + cn q^-n, of the same order n: 0 white noise, 1 a wandering load under white noise,
//          more: loads that come through the process. Held stable by their reflection coefficients
//
// K, y0, x0 are solved for at every step (variable projection); ln T1, ln T2, L and the noise model by numeric's
// bounded least squares. Missing y: e is 0 there. This is sound in open and in closed loop alike, as long as
// the noise model can describe the load: u may depend on past y in any way.
//
// Intervals: profile likelihood. A value lies within the interval of 95 % where, with all others fitted again, the
// sum of squares is at most 3.84 s^2 above the least, s^2 = sum/(N - parameters). They need not be symmetric
// and are infinite where the record sets no end.
//
// Errors: no exceptions. Limits: say whether u was moved by anything but the load (excitation.hpp).
//
// Sources: Ljung, System Identification (1999), ch. 3, 4, 13; Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973)
// (variable projection); Hannan and Rissanen, Biometrika 69 (1982) (start of the noise model); Bates and Watts,
// Nonlinear Regression (1988), ch. 6 (profiles).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/plant/process.hpp"

namespace loopwarden::analysis {

struct Estimate {
  double value = 0.0;
  double low = 0.0;  // interval of 95 %
  double high = 0.0;
};

enum class ProcessForm : std::uint8_t { one_lag, two_lags, integrating, integrating_lag };
const char* to_text(ProcessForm form) noexcept;
constexpr bool is_integrating(ProcessForm form) noexcept {
  return form == ProcessForm::integrating || form == ProcessForm::integrating_lag;
}

inline constexpr std::size_t kMostNoiseOrder = 3;

struct Samples {
  std::vector<double> u;  // CO units, less its first value, without gaps
  std::vector<double> y;  // PV units, less its mean
  double period_s = 1.0;
  std::size_t used = 0;  // of y

  std::size_t size() const noexcept { return u.size(); }
  double length_s() const noexcept { return static_cast<double>(size()) * period_s; }
};

// Columns of a start away from rest, at most.
inline constexpr std::size_t kMostStarts = 3;

struct NoiseModel {
  // Reflection coefficients of D and C through atanh.
  std::vector<double> d;
  std::vector<double> c;

  std::size_t order() const noexcept { return d.size(); }
};

struct PredictionFit {
  ProcessForm form = ProcessForm::one_lag;
  double gain = 0.0;
  double time_constant_s = 0.0;  // T1; 0 where integrating
  double second_lag_s = 0.0;     // T2; 0: none
  double dead_time_s = 0.0;
  double level = 0.0;                       // y0
  std::array<double, kMostStarts> start{};  // x0 and so on
  NoiseModel noise;
  double sum_squares = 0.0;  // of e
  double criterion = 0.0;    // Bayesian information criterion; the smaller the better

  std::size_t parameters() const noexcept;
};

// The best of a grid of time constants and dead times under three noise models, then least squares with noise
// of order 1.
PredictionFit start_fit(const Samples& samples, bool integrating);
// Least squares from `from`, with its form and noise order.
PredictionFit refined(const Samples& samples, const PredictionFit& from);
// `from` with a noise model of another order, started from its own residuals, refined.
PredictionFit with_noise_order(const Samples& samples, const PredictionFit& from,
                               std::size_t order);
// `from` with a second lag, refined from several starts.
PredictionFit with_second_lag(const Samples& samples, const PredictionFit& from);

struct Intervals {
  Estimate gain, time_constant_s, second_lag_s, dead_time_s;
};
// From the curvature at the fit alone: quick, for a form that is only compared.
Intervals curvature_intervals(const Samples& samples, const PredictionFit& fit);
// `fit` is replaced where a profile meets a better one.
Intervals profile_intervals(const Samples& samples, PredictionFit& fit);

// Standard error of the gain if only `u` (as Samples::u) had moved the process, its noise being that of `fit`.
double gain_error_under(const Samples& samples, const PredictionFit& fit,
                        const std::vector<double>& u);

// PV less its mean as the fit's process alone gives it: no noise model.
std::vector<double> free_run(const Samples& samples, const PredictionFit& fit);
// The innovations e.
std::vector<double> innovations(const Samples& samples, const PredictionFit& fit);

}  // namespace loopwarden::analysis
