// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/decision.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "model/diagnosis/decision_weights.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {
namespace {

// Returns an undecided verdict, because the remaining evidence has no meaning in this case.
ValveDecision undecided(std::string reason, std::string settle) {
  ValveDecision d;
  d.undecided = true;
  d.reason = std::move(reason);
  d.settle = std::move(settle);
  return d;
}

}  // namespace

const char* to_text(Grade grade) noexcept {
  return numeric::enum_name<Grade::seen>(grade, {"none", "likely", "seen"});
}

double logit(double p) { return std::log(p / (1.0 - p)); }
double from_logit(double z) { return 1.0 / (1.0 + std::exp(-z)); }

ValveTerms terms_of(const ValveEvidence& e) {
  const bool swings = e.reversals.by() == ReversalsBy::time;
  return {e.phase, std::clamp(e.play, Limits::kLeastPlay, Limits::kMostPlay), e.standing,
          swings ? 0.0 : std::sqrt(std::clamp(e.hammerstein, 0.0, Limits::kMostHammerstein))};
}

double ValveWeights::logit_of(const ValveTerms& x) const {
  return std::inner_product(x.begin(), x.end(), per.begin(), base);
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
  const ReversalsBy reversals = e.reversals.by();
  d.probability = std::clamp(from_logit(weights.logit_of(terms_of(e))), Limits::kLeastProbability,
                             Limits::kMostProbability);
  if (at_once && e.play > Limits::kSurePlay && e.hammerstein > Limits::kSureHammerstein) {
    d.probability = std::max(d.probability, Limits::kSeenFrom);
  }
  if (e.relation < Limits::kRelatedFrom)
    d.probability = std::min(d.probability, Limits::kUnrelatedMost);
  const bool no_band = e.play <= 0.0 && e.hammerstein <= Limits::kBandFrom;
  const bool in_step =
      at_once && e.phase < Limits::kInStep && e.hammerstein <= Limits::kHammersteinVotes;
  if (no_band || in_step) d.probability = std::min(d.probability, Limits::kDecidedBelow);
  const bool for_valve = d.probability >= Limits::kDecidedFrom;
  if (for_valve && reversals == ReversalsBy::time) {
    return undecided(
        "the cycle has a constant period and not a constant travel of CO, like an external "
        "oscillation; all other evidence indicates a sticking valve",
        "the loop in manual for some cycles: an oscillation that continues is external");
  }
  if (for_valve && reversals == ReversalsBy::clockwork) {
    return undecided(
        "the loop cycles with a constant period: a sticking valve and a regular load under tight "
        "control look alike",
        "the loop in manual for some cycles: if the cycle ends, the valve sticks");
  }
  if (for_valve && !at_once) {
    if (e.standing < Limits::kNeverStands) {
      return undecided("PV moves whenever CO does; with a sticking valve PV rests at times",
                       kManualSteps);
    }
    if (!e.reversals.cycles()) {
      return undecided(
          "the loop does not cycle, but most slow loops with a sticking valve do: a load may move "
          "PV and CO alike",
          kManualSteps);
    }
  }
  if (for_valve && (at_once || e.hammerstein > Limits::kLikelyLaterFrom)) {
    const bool seen = d.probability >= Limits::kSeenFrom && reversals == ReversalsBy::travel &&
                      e.standing > Limits::kStandsFrom &&
                      (at_once || e.hammerstein > Limits::kSeenLaterFrom);
    d.grade = seen ? Grade::seen : Grade::likely;
    return d;
  }
  if (!at_once && e.phase > 0.0 && e.play > 0.0 && reversals != ReversalsBy::time) {
    return undecided(
        follows == Follows::by_integration
            ? "the process integrates: PV lags CO by a quarter period without a sticking valve "
              "too, and one step ahead a sticking valve predicts PV no better"
            : "on a loop this slow PV lags CO without a sticking valve too, and one step ahead a "
              "sticking valve predicts PV no better",
        kManualSteps);
  }
  // Undecided, but the cycle suggests an external oscillation.
  if (reversals == ReversalsBy::time)
    d.probability = std::min(d.probability, Limits::kDecidedBelow);
  if (d.probability <= Limits::kDecidedBelow) return d;
  d.undecided = true;
  d.reason = "the evidence is contradictory: " + std::to_string(e.votes()) +
             " of three votes are for a valve effect";
  d.settle =
      std::string(kManualSteps) + "; or an hour more of routine data with set points that move";
  return d;
}

}  // namespace loopwarden::diagnosis
