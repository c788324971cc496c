// SPDX-License-Identifier: Apache-2.0
// Whether what is left of PV follows SP or CO. A load wanders by itself; what follows them is
// something that the model lacks.
//
//   A(q) e(k) = c0 + sum over i of c_i A(q) x_i(k) + n(k)          A: autoregression of e, n white
//   r F = explained / (left / (N - r))  against chi-squared of r degrees of freedom, 0.25 % each of four tests
//
//   e    what is left, PV units      N   samples of the stretch      r   rank of the columns
//   x_i  of one test each: past SP through 0 to 4 equal lags; its square, and the size of its moves (what answers up and
//        down alike), in the same way; CO's part that follows past SP (an instrument: in closed loop CO follows the load
//        itself), through 0 to 3 lags
//
// It follows where the test says so and what follows (sum of c_i x_i, rms) is large enough to
// matter. The test has no power where SP is unknown or stands, or where even all that is left, were
// it an answer to SP (no larger than SP's own moves), would not stand out; then it is not made.
// Where nothing is left there is nothing to test.
//
// What it can't do: a valve's cycle is not driven by SP, and what is left of it does not follow SP.
// Anything that repeats with SP by chance or design (a load that the operator answers by moving SP)
// is taken for an answer.
//
// Sources: Ljung, System Identification (1999), 16.6 (independence of residuals and inputs,
// whiteness); Söderström and Stoica, Instrumental Variable Methods (1983); Wilson and Hilferty,
// PNAS 17 (1931) 684-688 (chi-squared).
#pragma once

#include <string>
#include <vector>

#include "model/gap/record.hpp"

namespace loopwarden::gap {

// Columns of equal length, the whole record.
struct LeftOver {
  const std::vector<double>& error;  // PV units: measured minus simulated
  const std::vector<bool>& counts;   // samples that do
  const std::vector<double>& sp;     // PV units; empty: unknown
  const std::vector<double>& co;     // CO units; empty: not measured
  SampleRange stretch;               // that is tested
  double answer_s = 1.0;             // s, in which PV answers to CO
  double period_s = 0.1;             // s
  double left_rms = 0.0;             // PV units: of the error, without the transmitter's noise
  double nothing_rms = 0.0;          // PV units: no more left, and there is nothing to test
  double matters_rms = 0.0;          // PV units: less that follows does not matter
};

struct Independence {
  bool tested = false;  // what follows SP would have been seen
  std::string why_not;  // a clause, where it was not
  bool follows_sp = false;
  bool follows_co = false;
  double follows_rms = 0.0;  // PV units, of what follows

  bool follows() const noexcept { return follows_sp || follows_co; }
};

Independence test_independence(const LeftOver& left);

}  // namespace loopwarden::gap
