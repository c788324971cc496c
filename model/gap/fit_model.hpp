// SPDX-License-Identifier: Apache-2.0
// Third stage: what the hypotheses are fitted with. The free run of the model under the measured
// CO, the fitter over the first two thirds, and the candidates that this record can show at all.
//
// A candidate is left out if nothing could support it: effects of valve and process if CO hardly
// moves, those of a valve if the model states that there is none, a constant if CO was not
// measured. If the model does not state process.level, PV's level is a part of every fit, and not a
// candidate (level.hpp).
#pragma once

#include <vector>

#include "model/gap/check.hpp"
#include "model/gap/fit.hpp"
#include "model/gap/search.hpp"

namespace loopwarden::gap {

// Every Fit that the fitter makes points into `searched`: none may outlive this.
class ModelFit {
 public:
  // Loads above `largest_load`, of the PV span per root second, are not modelled. Throws
  // effects::EffectError for a model that can't be stepped.
  ModelFit(const CheckedRecord& record, const SearchOptions& options, double largest_load);
  ModelFit(const ModelFit&) = delete;
  ModelFit& operator=(const ModelFit&) = delete;

  // Over the holdout too: for its proof only.
  Fitter over_whole_record() const;

  const FreeRun run;
  const std::vector<Candidate> searched;
  const double least_rms;         // PV units: what an effect moves PV by at least
  const double valve_rms;         // PV units: what a healthy valve leaves
  const double largest_load_rms;  // PV units: what a quiet load adds to a free run at the most

 private:
  const CheckedRecord& record_;
  SearchOptions options_;
  AllowedWander allowed_;

 public:
  Fitter fitter;
};

}  // namespace loopwarden::gap
