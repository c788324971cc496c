// SPDX-License-Identifier: Apache-2.0
// Sixth stage: the last third of the record, which nothing was fitted to, may take back what the first two
// thirds gave. It never changes a name.
//
// Where noise and a quiet load account for what the choice leaves, its innovations are held against those
// of the model alone, a load allowed to both; elsewhere the free runs are.
//
// What it can't do: an effect that ends before the holdout looks refuted.
#pragma once

#include <vector>

#include "model/gap/fit_model.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

struct Trial {
  bool rest_is_noise = true;
  double model_innovations = 0.0;   // PV units squared, sum over the holdout
  double choice_innovations = 0.0;  // PV units squared, sum over the holdout
  double model_rmse = 0.0;          // PV units, free run over the holdout
  double choice_rmse = 0.0;         // PV units, free run over the holdout
};
bool refuted(const Trial& trial) noexcept;

// `before` and `after`: free runs of the model alone and with the choice.
Trial try_on_holdout(const ModelFit& model_fit, const SearchResult& search,
                     const CheckedRecord& record, bool rest_is_noise, const Misfit& before,
                     const Misfit& after);

}  // namespace loopwarden::gap
