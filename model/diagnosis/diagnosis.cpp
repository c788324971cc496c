// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::diagnosis {
namespace {

constexpr double kRegular = 1.0;      // Thornhill's bound
constexpr double kLeastPeak = 0.3;    // of the autocorrelation one period on
constexpr double kAlternative = 0.1;  // probability from which the other valve effect is named too
constexpr double kLeastCycles = 3.0;

double probability(const CauseProbabilities& p, Cause cause) {
  return p[static_cast<std::size_t>(cause)];
}

RoutineRecord part_of(const RoutineRecord& r, std::size_t from, std::size_t count) {
  RoutineRecord part = r;
  part.pv = r.pv.subspan(from, count);
  part.co = r.co.subspan(from, count);
  if (r.sp.size() == r.pv.size()) part.sp = r.sp.subspan(from, count);
  return part;
}

// Weighted mean of the logarithms of the looks at the whole and at its two parts.
CauseProbabilities weigh_with_parts(const RoutineRecord& record, const Evidence& of_whole) {
  CauseProbabilities sums{};
  double weights = 0.0;
  const auto add = [&](const Evidence& evidence, double weight) {
    const CauseProbabilities p = weigh(evidence);
    for (std::size_t c = 0; c < kCauseCount; ++c) {
      sums[c] += weight * std::log(std::max(p[c], 1e-12));
    }
    weights += weight;
  };
  add(of_whole, 1.0);
  const std::size_t n = record.pv.size();
  const auto count = static_cast<std::size_t>(kPart * static_cast<double>(n));
  for (const std::size_t from : {std::size_t{0}, n - count}) {
    const Prepared part = prepare(part_of(record, from, count));
    if (part.refusal.empty()) add(find_evidence(part).evidence, kPartWeight);
  }
  double total = 0.0;
  for (double& v : sums) total += v = std::exp(kSharpening * v / weights);
  for (double& v : sums) v /= total;
  return sums;
}

bool oscillates(const Oscillation& o) { return o.regularity > kRegular && o.peak > kLeastPeak; }

}  // namespace

const char* to_text(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::valve_effect: return "valve_effect";
    case Verdict::other_cause: return "other_cause";
    case Verdict::healthy: return "healthy";
    case Verdict::not_enough_data: return "not_enough_data";
  }
  return "";
}

Diagnosis diagnose(const RoutineRecord& record) {
  Diagnosis d;
  d.prepared = prepare(record);
  if (!d.prepared.refusal.empty()) {
    d.reason = d.prepared.refusal;
    return d;
  }
  d.findings = find_evidence(d.prepared);
  d.probabilities = weigh_with_parts(record, d.findings.evidence);
  d.oscillating = d.prepared.cycles >= kLeastCycles &&
                  (oscillates(d.prepared.pv_oscillation) || oscillates(d.prepared.co_oscillation));
  if (d.oscillating) d.period_s = d.prepared.period_s;
  d.integrating = d.findings.fit.integrating_gain > 0.0;

  const double stiction = probability(d.probabilities, Cause::stiction);
  const double backlash = probability(d.probabilities, Cause::backlash);
  if (stiction + backlash >= kValveThreshold) {
    d.verdict = Verdict::valve_effect;
    const bool sticks = kBacklashOdds * stiction >= backlash;
    d.cause = sticks ? Cause::stiction : Cause::backlash;
    const Cause other = sticks ? Cause::backlash : Cause::stiction;
    if (probability(d.probabilities, other) >= kAlternative) d.alternative = other;
    const ValveFit& fit = d.findings.fit;
    const double fitted = d.cause == Cause::stiction ? fit.s : fit.backlash_deadband;
    d.s = std::sqrt(fitted * fit.output_range);
    if (d.cause == Cause::stiction && fit.s > 0.0) d.j = d.s * fit.j / fit.s;
    d.s_low = d.s / kSizeFactor;
    d.s_high = d.s * kSizeFactor;
    // A valve's cycle need not repeat from one period to the next.
    d.oscillating |= d.prepared.pv_oscillation.regularity > kRegular ||
                     d.prepared.co_oscillation.regularity > kRegular;
    if (d.oscillating) d.period_s = d.prepared.period_s;
    return d;
  }
  const std::initializer_list<Cause> others{Cause::tuning, Cause::disturbance, Cause::saturation};
  const Cause most = *std::max_element(others.begin(), others.end(), [&](Cause a, Cause b) {
    return probability(d.probabilities, a) < probability(d.probabilities, b);
  });
  const bool ails = probability(d.probabilities, most) > probability(d.probabilities, Cause::none);
  if (d.oscillating || (ails && most == Cause::saturation)) {
    d.verdict = Verdict::other_cause;
    d.cause = most;
  } else {
    d.verdict = Verdict::healthy;
  }
  return d;
}

}  // namespace loopwarden::diagnosis
