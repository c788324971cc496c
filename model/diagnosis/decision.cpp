// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/decision.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::diagnosis {
namespace {

// At once: w0, w1, w2, w3. `loopwarden-study diagnose --records` fits them again with each loop left out.
constexpr double kBase = 0.3;
constexpr double kPerPhase = 0.6;
constexpr double kPerPlay = 0.4;
constexpr double kPerHammerstein = 7.0;
// Hammerstein evidence alone must be half as strong again: behind a slow process the band is blurred.
constexpr double kBaseAlone = -2.2;
constexpr double kAlone = 18.0;

constexpr const char* kStep =
    "in manual, step CO by 2 % up, then by 2 % up and down again, and look when PV answers";

}  // namespace

const char* to_text(Grade grade) noexcept {
  switch (grade) {
    case Grade::none: return "none";
    case Grade::likely: return "likely";
    case Grade::seen: return "seen";
  }
  return "";
}

double logit(double p) { return std::log(p / (1.0 - p)); }
double from_logit(double z) { return 1.0 / (1.0 + std::exp(-z)); }

ValveDecision decide(const ValveEvidence& e, Follows follows) {
  ValveDecision d;
  const bool at_once = follows == Follows::at_once;
  const double z =
      at_once ? kBase + kPerPhase * e.phase + kPerPlay * e.play + kPerHammerstein * e.hammerstein
              : kBaseAlone + kAlone * e.hammerstein;
  d.probability = std::clamp(from_logit(z), kLeastProbability, kMostProbability);
  const bool seen = e.hammerstein > kSeenFrom;
  if (d.probability >= kDecidedFrom && e.hammerstein > 0.0) {
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
