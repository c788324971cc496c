// SPDX-License-Identifier: Apache-2.0
// Last stage: what was found, in words and with its parameters and their intervals.
//
//   interval = value +- 1.96 standard deviations by the curvature of the likelihood (Fitter::spread)
//
// What it can't do: intervals count noise only. Where the model's law is not the plant's they are
// too narrow.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/gap/decide.hpp"
#include "model/gap/fit_model.hpp"
#include "model/gap/level.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

// The effects that were named, in their order.
std::vector<FoundEffect> describe_effects(const Decision& decision, Proof proof,
                                          const SearchResult& search, const ModelFit& model_fit);

// PV at CO 0 that the model does not state.
FoundEffect describe_level(const NamedEffect& named, const LevelFinding& level,
                           const Misfit& before, const Misfit& after);
TriedCandidate describe_level_tried(const LevelFinding& level, const SearchResult& search,
                                    bool named, Outcome outcome);

// Other settings of the controller than the model's.
FoundEffect describe_controller(const ControllerFinding& found, const control::PidGains& model);

// What the flat places of PV say that the model's transmitter does not.
std::vector<FoundEffect> describe_reading(const ReadingFinding& reading,
                                          const plant::LoopModel& model);

// Every effect that was fitted alone. `chosen` and the reasons are those of the verdict.
std::vector<TriedCandidate> describe_tried(const SearchResult& search, const ModelFit& model_fit,
                                           Outcome outcome);

// What of bias and drift the load that wanders in the record would hide; empty: nothing worth a
// word.
std::string hidden_by_load(const SearchResult& search, const ModelFit& model_fit);

// What the sentence is about.
struct Summary {
  Outcome outcome = Outcome::no_gap;
  const std::vector<FoundEffect>& effects;
  const Misfit& before;
  const Misfit& after;
  const std::optional<Remainder>& remainder;
  const std::vector<std::string>& best;  // names that did not hold on the holdout
  double best_closed = kNone;            // gap closed by them there
  bool closed_loop = false;
  bool plant_unexplained = false;  // only the controller is named
  bool with_load = false;          // an unmeasured load was seen
  double until_s =
      kNone;  // s: the names are proved up to here, and nothing foretells how they go on
};
std::string sentence_of(const Summary& summary);

}  // namespace loopwarden::gap
