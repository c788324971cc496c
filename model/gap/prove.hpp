// SPDX-License-Identifier: Apache-2.0
// Sixth stage: the last third of the record, which nothing was fitted to, may take back what the
// first two thirds gave. It never changes a name.
//
//   gap closed = (before^2 - after^2)/(before^2 - floor^2), -1 to 1
//
//   before, after  rmse of the free run over the holdout, of the model alone and with the choice, PV units
//   floor          Result::floor, PV units: the transmitter's, and a load that passed for one
//
// From 80 % on the names hold, from 50 % on partly, below they are refuted, and so they are where
// the free run gets worse by more than the transmitter's noise and what does not matter. Where
// before is below two floors there is no such figure. Then names that the data of the fit make
// believable are held against the model alone: by innovations, a load allowed to both, where noise
// and a quiet load account for what the choice leaves; elsewhere by the free runs.
//
// What it can't do: an effect that ends before the holdout looks refuted; one that wanders on is
// tried on blocks left out instead (workflow.cpp).
#pragma once

#include "model/gap/confidence.hpp"
#include "model/gap/fit_model.hpp"
#include "model/gap/proof.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

// -1 to 1; NaN where there is no gap to speak of.
double gap_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept;

struct Trial {
  bool believable = true;  // on the data of the fit
  bool rest_is_noise = true;
  double closed = kNone;            // gap closed
  double model_innovations = 0.0;   // PV units squared, sum over the holdout
  double choice_innovations = 0.0;  // PV units squared, sum over the holdout
  double model_rmse = 0.0;          // PV units, free run over the holdout
  double choice_rmse = 0.0;         // PV units, free run over the holdout
  double trifle_rmse = 0.0;         // PV units: the transmitter's floor and what does not matter
};
Proof judge(const Trial& trial) noexcept;

// `before` and `after`: free runs of `model` alone and with the `choice`.
Trial try_on_holdout(const ModelFit& model_fit, const Fit& model, const Fit& choice,
                     const CheckedRecord& record, const Residuals& left, const Floor& floor,
                     const Misfit& before, const Misfit& after);

}  // namespace loopwarden::gap
