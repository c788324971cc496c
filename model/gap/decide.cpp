// SPDX-License-Identifier: Apache-2.0
#include "model/gap/decide.hpp"

#include <algorithm>

#include "model/gap/constants.hpp"

namespace loopwarden::gap {
namespace {

EffectSet effect_set_of(const Hypothesis& hypothesis) {
  return {names_in_order(hypothesis.fit), hypothesis.score, hypothesis.training_rmse,
          hypothesis.placed};
}

std::vector<std::string> alternatives_to(const std::string& name, const Competition& competition) {
  const EffectSet& chosen = competition.chosen;
  std::vector<std::string> out;
  for (const EffectSet& other : competition.tried) {
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
  out.unexplained =
      controller.unexplained || (!left.adequate && leaves_more(competition.model_rmse, scale));
  out.believable = left.believable;
  const std::vector<double> by = leads(competition.chosen, competition.tried);
  for (std::size_t i = 0; i < by.size(); ++i) {
    const std::string& name = competition.chosen.names[i];
    out.named.push_back(
        {name, by[i], confidence(by[i], left.adequate, table), alternatives_to(name, competition)});
  }
  return out;
}

double confidence_after(double confidence, Proof proof) noexcept {
  return proof == Proof::partly ? std::min(confidence, kPartlyConfidence) : confidence;
}

Outcome outcome_of(const Decision& decision, Proof proof) noexcept {
  if (decision.by_reading) return Outcome::missing_effect;
  const bool named = !decision.named.empty();
  if (named && proof != Proof::refuted) return Outcome::missing_effect;
  // Other settings of the controller close nothing of a gap of the plant.
  if (decision.unexplained || (named && decision.believable)) return Outcome::unexplained;
  return decision.other_settings ? Outcome::missing_effect : Outcome::no_gap;
}

}  // namespace loopwarden::gap
