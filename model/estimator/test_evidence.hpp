// SPDX-License-Identifier: Apache-2.0
// Log-likelihood of PV during a test under samples of an explanation.
//
//   log p(PV | sample) = -1/2 sum of innovations^2        constants that all samples share left out
//
// The innovations are those of the error PV - PV of the sample, whitened by the filter of noise,
// disturbance and error of the law (error_filter.hpp). The level before the move is a nuisance.
#pragma once

#include <cstddef>
#include <vector>

#include "model/estimator/blocks.hpp"
#include "model/estimator/error_filter.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::estimator {

class TestEvidence {
 public:
  // `co`: CO units, of the `before` samples before the move and of the test. `noise_rms`,
  // `law_error`: PV units. `disturbance`: PV units per root second.
  TestEvidence(const plant::LoopModel& model, const std::vector<double>& co, std::size_t before,
               double noise_rms, double disturbance, double law_error);

  // `error`: PV less PV of the sample, PV units, as long as CO.
  double log_likelihood(std::vector<double> error) const;

 private:
  std::size_t before_;
  Blocks blocks_;
  ErrorFilter filter_;
};

// log of the mean of the exponentials.
double log_mean(const std::vector<double>& log_values);

}  // namespace loopwarden::estimator
