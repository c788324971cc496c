// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/decision.hpp"

#include <algorithm>
#include <cmath>

#include "model/diagnosis/decision_weights.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr const char* kStep =
    "in manual, step CO by 2 % up, then by 2 % up and down again, and look when PV answers";

}  // namespace

const char* to_text(Grade grade) noexcept {
  return numeric::enum_name<Grade::seen>(grade, {"none", "likely", "seen"});
}

double logit(double p) { return std::log(p / (1.0 - p)); }
double from_logit(double z) { return 1.0 / (1.0 + std::exp(-z)); }

ValveTerms terms_of(const ValveEvidence& e) {
  return {e.phase, e.play, std::sqrt(std::max(0.0, e.hammerstein))};
}

double ValveWeights::logit_of(const ValveTerms& x) const {
  return base + per[0] * x[0] + per[1] * x[1] + per[2] * x[2];
}

const ValveWeights& weights_for(Follows follows) {
  return follows == Follows::at_once ? kAtOnce : kLater;
}

ValveDecision decide(const ValveEvidence& e, Follows follows) {
  return decide(e, follows, weights_for(follows));
}

ValveDecision decide(const ValveEvidence& e, Follows follows, const ValveWeights& weights) {
  ValveDecision d;
  const bool at_once = follows == Follows::at_once;
  d.probability =
      std::clamp(from_logit(weights.logit_of(terms_of(e))), kLeastProbability, kMostProbability);
  if (d.probability >= kDecidedFrom && e.hammerstein > kLikelyFrom) {
    const bool seen = at_once ? e.hammerstein > kSeenFrom && e.parts_for >= kPartsFor
                              : e.hammerstein > kSeenLaterFrom && e.parts_for >= kPartsForLater;
    d.grade = seen ? Grade::seen : Grade::likely;
    return d;
  }
  const bool spoken_for = e.phase > 0.0 && e.play > 0.0;
  if (!at_once && spoken_for) {
    d.undecided = true;
    d.probability = 0.5;  // what is left means nothing here, either way
    d.reason =
        follows == Follows::by_integration
            ? "the process integrates: PV lags CO by a quarter period without a sticking valve "
              "too, and one step ahead a sticking valve foretells PV no better"
            : "on a loop this slow PV lags CO without a sticking valve too, and one step ahead a "
              "sticking valve foretells PV no better";
    d.settle = kStep;
    return d;
  }
  if (d.probability >= kDecidedFrom) {
    d.undecided = true;
    d.probability = 0.5;
    d.reason =
        "PV lags CO as behind a sticking valve, but also as under integral control against a slow "
        "load, and one step ahead "
        "a sticking valve foretells PV no better";
    d.settle = std::string(kStep) + "; or routine data with set points that move";
    return d;
  }
  if (d.probability <= kDecidedBelow) return d;
  d.undecided = true;
  d.reason = "the evidence speaks both ways: " + std::to_string(e.votes()) +
             " of three votes are for a valve effect";
  d.settle = std::string(kStep) + "; or an hour more of routine data with set points that move";
  return d;
}

}  // namespace loopwarden::diagnosis
