// SPDX-License-Identifier: Apache-2.0
// Fifth stage: what is missing, how sure, and what else it may be. From scores, from what the
// chosen explanation leaves, and from what the controller did; the holdout has no part in it
// (prove.hpp).
//
//   named         what the search chose
//   believable    what they leave is noise and a quiet load, or they close so much of the gap on the data
//                 of the fit that the names stand although more is left
//   alternatives  names of explanations of as many effects, too near in score to be told apart
//   unexplained   more is left than noise and load, of a size that matters, and nothing accounts for it
//
// Limits: constants.hpp; confidence: confidence.hpp.
//
// What it can't do: a cause that none of the candidates resembles is not named, but one that
// resembles it may be, with the confidence of its lead.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/gap/accept.hpp"
#include "model/gap/confidence.hpp"
#include "model/gap/controller.hpp"
#include "model/gap/proof.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

// What the search brought, by names and scores alone.
struct Competition {
  EffectSet chosen;
  std::vector<EffectSet> tried;
  double model_rmse = 0.0;  // PV units: of the model alone, first two thirds
};
Competition competition_of(const SearchResult& search);

struct NamedEffect {
  std::string name;
  double lead_nats = 0.0;
  double confidence = 0.0;
  std::vector<std::string> alternatives;
};

struct Decision {
  std::vector<NamedEffect> named;    // in the order in which they were found
  std::optional<NamedEffect> level;  // PV at CO 0 is another than the model's (level.hpp)
  bool believable = true;            // without a look at the holdout
  bool other_settings = false;       // of the controller
  bool exact_settings = false;       // they are all of what CO does, whatever the plant lacks
  bool by_reading = false;           // what PV's flat places say of the transmitter
  bool unexplained = false;          // more is left than noise and a quiet load

  bool names_any() const noexcept { return !named.empty() || level.has_value(); }
};

Decision decide(const Competition& competition, const Residuals& left,
                const ControllerFinding& controller, const Scale& scale,
                const ConfidenceTable& table = kConfidenceTable);

// What partly holds is given with less than the confidence of a sure name.
double confidence_after(double confidence, Proof proof) noexcept;

Outcome outcome_of(const Decision& decision, Proof proof) noexcept;

}  // namespace loopwarden::gap
