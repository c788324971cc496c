// SPDX-License-Identifier: Apache-2.0
#include "model/gap/decide.hpp"

#include <algorithm>

#include "model/gap/constants.hpp"

namespace loopwarden::gap {
namespace {

std::vector<std::string> alternatives_to(const std::string& name, const EffectSet& chosen,
                                         const std::vector<EffectSet>& rivals) {
  std::vector<std::string> out;
  for (const EffectSet& other : rivals) {
    if (other.names.size() != chosen.names.size() || other.has(name)) continue;
    if (chosen.score - other.score > kTooClose) continue;
    for (const std::string& instead : other.names) {
      if (!chosen.has(instead) && std::find(out.begin(), out.end(), instead) == out.end()) {
        out.push_back(instead);
      }
    }
  }
  return out;
}

// Where the choice closes a part of the gap, what closes none is no explanation, however likely a
// load makes it.
std::vector<EffectSet> rivals_in(const Competition& c, double noise_rms) {
  const auto closes = [&](const EffectSet& set) {
    return closes_a_part(set.training_rmse, c.model_rmse, c.model_rmse, noise_rms);
  };
  std::vector<EffectSet> out = c.tried;
  if (closes(c.chosen)) std::erase_if(out, [&](const EffectSet& set) { return !closes(set); });
  return out;
}

}  // namespace

Competition competition_of(const SearchResult& search) {
  Competition out{effect_set_of(search.chosen), {}, search.base_rmse};
  for (const Hypothesis& hypothesis : search.tried) out.tried.push_back(effect_set_of(hypothesis));
  return out;
}

Decision decide(const Competition& competition, const Residuals& left,
                const ControllerFinding& controller, const Scale& scale,
                const ConfidenceTable& table) {
  Decision out;
  out.other_settings = controller.mismatch;
  out.exact_settings = controller.mismatch && controller.exact;
  out.unexplained =
      controller.unexplained || (!left.adequate && leaves_more(competition.model_rmse, scale));
  out.believable = left.believable;
  const std::vector<EffectSet> rivals = rivals_in(competition, scale.noise_rms);
  const std::vector<double> by = leads(competition.chosen, rivals);
  for (std::size_t i = 0; i < by.size(); ++i) {
    const std::string& name = competition.chosen.names[i];
    out.named.push_back({name, by[i], confidence(by[i], left.adequate, table),
                         alternatives_to(name, competition.chosen, rivals)});
  }
  return out;
}

double confidence_after(double confidence, Proof proof) noexcept {
  return proof == Proof::partly ? std::min(confidence, kPartlyConfidence) : confidence;
}

Outcome outcome_of(const Decision& decision, Proof proof) noexcept {
  if (decision.by_reading) return Outcome::missing_effect;
  const bool named = decision.names_any();
  if (named && proof != Proof::refuted) return Outcome::missing_effect;
  // Other settings of the controller close nothing of a gap of the plant, but what makes CO to the
  // last step is found.
  if (decision.unexplained || (named && decision.believable)) {
    return decision.exact_settings ? Outcome::missing_effect : Outcome::unexplained;
  }
  return decision.other_settings ? Outcome::missing_effect : Outcome::no_gap;
}

}  // namespace loopwarden::gap
