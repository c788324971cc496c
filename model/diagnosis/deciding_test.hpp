// SPDX-License-Identifier: Apache-2.0
// Plans the smallest move of CO in manual that decides what a routine record leaves open about a
// valve (estimator/plan.hpp).
//
//   explanations  stiction and backlash of the band of the diagnosis, and a good valve; equally
//                 probable, because the test must decide whichever is true
//   process       gain, lag and dead time of the most likely point of the band's grid
//   noise         differences of the error over one sample
//   disturbance   differences of the error over `kSlow` times the response
//
// The error is PV minus a free run with the band. If no move within the limits tells all three
// apart, a test is planned that only tells a band from a good valve. If that fails too, `beyond`
// of the plan is a larger test.
//
// Limits: the record gives no controller, so the loop is moved in manual. Errors: none; nullopt if
// the record shows no band or no response of PV.
#pragma once

#include <array>
#include <optional>

#include "model/diagnosis/diagnosis.hpp"
#include "model/estimator/plan.hpp"

namespace loopwarden::diagnosis {

struct TestedLoop {
  double period_s = 1.0;                            // of the record
  std::array<double, 2> outputs{0.0, 100.0};        // CO units, ends of the range
  std::optional<std::array<double, 2>> pv_range{};  // PV units, of the transmitter
};

struct DecidingTest {
  std::vector<estimator::Explanation> explanations;  // that it tells apart
  estimator::Planned planned;
  double pv_span = 0.0;        // PV units
  bool pv_span_known = false;  // otherwise gain times the span of CO
  double pv = 0.0;             // PV units, at the start
  double band = 0.0;           // CO units
  bool names_effect = false;   // stiction and backlash are told apart too
};

// Mean over the likelihood of the bands of a sticking valve, CO units.
double tested_band(const estimator::BandEvidence& found);

std::optional<DecidingTest> plan_deciding_test(const Diagnosis& diagnosis, const TestedLoop& loop,
                                               const numeric::ParallelFor& parallel);

}  // namespace loopwarden::diagnosis
