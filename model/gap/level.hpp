// SPDX-License-Identifier: Apache-2.0
// Decides whether the record shows another PV at CO 0 than the model, where that was fitted beside
// everything else.
//
// The chosen explanation is fitted again with PV at CO 0 held at the model's own. The level is
// shown if the fit with it is better by the rules for one more effect (accept.hpp): the first one
// if nothing else was chosen.
//
// What it can't do: nothing in one record tells a level that the model does not state from a bias
// of the transmitter or from a constant disturbance.
#pragma once

#include "model/gap/fit.hpp"
#include "model/gap/search.hpp"

namespace loopwarden::gap {

struct LevelFinding {
  bool shown = false;
  double level = 0.0;      // PV units, beyond the model's
  double spread = 0.0;     // PV units, standard deviation
  double lead_nats = 0.0;  // over the same explanation at the model's own level
  // At the model's own level:
  Fit base;                // the model without effects
  double base_rmse = 0.0;  // PV units, first two thirds
  Hypothesis chosen;       // the chosen effects
};

// `fitter` fits the level; it is the same again after the call.
LevelFinding find_level(Fitter& fitter, const SearchResult& search, const Scale& scale);

}  // namespace loopwarden::gap
