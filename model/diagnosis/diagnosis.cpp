// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/diagnosis/features.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/hold_evidence.hpp"
#include "model/diagnosis/time_scales.hpp"
#include "model/diagnosis/deciding_test.hpp"
#include "model/estimator/slip_jump.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/enum_name.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::diagnosis {
namespace {

bool oscillates(const Oscillation& o) {
  return o.regularity > Limits::kRegular && o.peak > Limits::kLeastPeak;
}
bool cycles(const Prepared& p) {
  return p.cycles >= Limits::kLeastCycles &&
         (oscillates(p.pv_oscillation) || oscillates(p.co_oscillation));
}

void measure(Diagnosis& d) {
  const Series& pv = d.prepared.raw_pv;
  const Series& co = d.prepared.raw_co;
  // Set points that move hide a cycle that is shorter than they are.
  const double moves = movement_period(co, pv);
  const double cycle = d.prepared.period * static_cast<double>(d.prepared.factor);
  const double period = cycles(d.prepared) && cycle < Limits::kShorter * moves ? cycle : moves;
  const auto wanted = static_cast<std::size_t>(std::ceil(period / Limits::kSamplesPerPeriod));
  const std::size_t factor = std::clamp<std::size_t>(
      wanted, 1, std::max<std::size_t>(1, pv.size() / Limits::kLeastOfBlocks));
  const double blocks = period / static_cast<double>(factor);
  const Series pv_blocks = block_means(pv, factor);
  const Series co_blocks = block_means(co, factor);
  d.band = estimator::find_band(pv, co, moves);
  d.evidence = {.log_odds = d.band.log_odds,
                .share = d.band.share,
                .explained = d.band.explained,
                .standing = hold_evidence(pv_blocks, co_blocks, blocks),
                .jump = d.band.log_odds >= Limits::kNamedFrom
                            ? estimator::find_slip_jump(pv, co, d.band)
                            : 0.0,
                .reversals = find_reversals(high_passed(
                    detrended(co_blocks),
                    std::max<std::size_t>(
                        2, static_cast<std::size_t>(Limits::kWindowPeriods * blocks + 0.5))))};
}

// Returns whether the set point swings with PV's own period, and PV with it: the cause is the
// master.
bool master_swings(const Prepared& p) {
  if (p.raw_sp.empty() || !p.set_point_active) return false;
  const TimeScale sp = find_time_scale(p.raw_sp);
  const TimeScale pv = find_time_scale(p.raw_pv);
  return oscillates(sp.oscillation) && oscillates(pv.oscillation) &&
         std::abs(sp.oscillation.period / pv.oscillation.period - 1.0) < Limits::kSamePeriod;
}

// Names stiction or backlash, and the size.
void name_valve_effect(Diagnosis& d) {
  const CauseProbabilities p = weigh(find_features(d.prepared, d.evidence));
  const double stiction = p[static_cast<std::size_t>(Cause::stiction)];
  const double backlash = p[static_cast<std::size_t>(Cause::backlash)];
  const double by_shape = logit(std::clamp(
      stiction / std::max(stiction + Limits::kBacklashOdds * backlash, 1e-12), 1e-4, 1.0 - 1e-4));
  // Friction that varies moves the slips: only a jump that PV shows counts.
  const double by_jump = Limits::kPerNat * std::clamp(d.evidence.jump, 0.0, Limits::kMostNats);
  d.stiction_share = from_logit(by_shape + by_jump);
  const bool sticks = d.stiction_share >= 0.5;
  d.cause = sticks ? Cause::stiction : Cause::backlash;
  const double other = sticks ? 1.0 - d.stiction_share : d.stiction_share;
  if (other >= Limits::kAlternative) d.alternative = sticks ? Cause::backlash : Cause::stiction;
  d.s = Limits::kSizeScale * d.band.band;
  d.s_low = d.s / Limits::kSizeFactor;
  d.s_high = d.s * Limits::kSizeFactor;
  // The cycle of a valve need not repeat from one period to the next.
  d.oscillating |= d.prepared.pv_oscillation.regularity > Limits::kRegular ||
                   d.prepared.co_oscillation.regularity > Limits::kRegular;
}

void name_other_cause(Diagnosis& d) {
  d.verdict = DiagnosisVerdict::other_cause;
  if (master_swings(d.prepared)) {
    d.cause = Cause::master_loop;
    return;
  }
  const CauseProbabilities p = weigh(find_features(d.prepared, d.evidence));
  const auto others = {Cause::tuning, Cause::disturbance, Cause::saturation};
  d.cause = *std::max_element(others.begin(), others.end(), [&p](Cause a, Cause b) {
    return p[static_cast<std::size_t>(a)] < p[static_cast<std::size_t>(b)];
  });
}

// Draws the conclusion from the evidence.
void conclude(Diagnosis& d) {
  d.grade = Grade::none;
  d.cause = d.alternative = Cause::none;
  d.reason.clear();
  d.settle.clear();
  d.testable = false;
  d.oscillating = cycles(d.prepared);
  const ValveDecision decision = decide(d.evidence);
  d.probability = decision.probability;
  d.grade = decision.grade;
  if (decision.grade != Grade::none) {
    d.verdict = DiagnosisVerdict::valve_effect;
    name_valve_effect(d);
  } else if (decision.undecided) {
    d.verdict = DiagnosisVerdict::cant_tell;
    d.reason = decision.reason;
    d.testable = !decision.by_cycle;
    d.settle = decision.by_cycle
                   ? numeric::text(
                         "the loop in manual for %.3g s (three cycles): if the cycle ends, the "
                         "valve sticks",
                         3.0 * d.prepared.period_s)
                   : numeric::text(
                         "in manual, move CO by %.3g CO units (%.2g times a band that would "
                         "explain the record) in three equal steps and back; or an hour more "
                         "of routine data with set points that move",
                         Limits::kCrossedBands * tested_band(d.band), Limits::kCrossedBands);
  } else if (d.oscillating || d.evidence.reversals.by() == ReversalsBy::time ||
             d.evidence.reversals.by() == ReversalsBy::clockwork) {
    d.oscillating = true;
    name_other_cause(d);
  } else {
    d.verdict = DiagnosisVerdict::healthy;
  }
  if (d.oscillating) d.period_s = d.prepared.period_s;
}

}  // namespace

const char* to_text(DiagnosisVerdict verdict) noexcept {
  return numeric::enum_name<DiagnosisVerdict::cant_tell>(
      verdict, {"valve_effect", "other_cause", "healthy", "not_enough_data", "cant_tell"});
}

Diagnosis diagnose(const numeric::LoopView& record, LoopType type) {
  Diagnosis d;
  d.loop_type = type;
  d.prepared = prepare(record);
  d.reason = d.prepared.refusal;
  d.settle = d.prepared.settle;
  switch (d.prepared.gate) {
    case Gate::too_little: return d;
    case Gate::sensor: d.cause = Cause::sensor; break;
    case Gate::no_flow: d.cause = Cause::no_flow; break;
    case Gate::saturation: d.cause = Cause::saturation; break;
    case Gate::open: break;
  }
  if (d.prepared.gate != Gate::open) {
    d.verdict = DiagnosisVerdict::other_cause;
    return d;
  }
  measure(d);
  conclude(d);
  return d;
}

void share_reversals(std::span<Diagnosis*> windows) {
  Reversals all;
  std::size_t with_four = 0;
  for (const Diagnosis* d : windows) {
    const Reversals& reversals = d->evidence.reversals;
    if (!d->judged() || reversals.count < Limits::kLeastReversals) continue;
    all.count += reversals.count;
    const double share = static_cast<double>(reversals.count) / static_cast<double>(all.count);
    all.travel_scatter += share * (reversals.travel_scatter - all.travel_scatter);
    all.cycle_scatter += share * (reversals.cycle_scatter - all.cycle_scatter);
    if (reversals.four_cycle_scatter <= 0.0) continue;
    with_four += reversals.count;
    all.four_cycle_scatter += static_cast<double>(reversals.count) /
                              static_cast<double>(with_four) *
                              (reversals.four_cycle_scatter - all.four_cycle_scatter);
  }
  for (Diagnosis* d : windows) {
    if (!d->judged()) continue;
    const Reversals& own = d->evidence.reversals;
    const bool changes = own.by() != all.by() || own.cycles() != all.cycles();
    d->evidence.reversals = all;
    if (changes) conclude(*d);
  }
}

SizeTrend size_trend(std::span<const Diagnosis> windows) {
  SizeTrend trend;
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    if (windows[i].verdict == DiagnosisVerdict::valve_effect) at.push_back(i);
  }
  trend.windows = at.size();
  if (at.empty()) return trend;
  trend.first = windows[at.front()].s;
  trend.last = windows[at.back()].s;
  Series slopes;
  for (std::size_t b = 1; b < at.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      slopes.push_back((windows[at[b]].s - windows[at[a]].s) / static_cast<double>(at[b] - at[a]));
    }
  }
  if (!slopes.empty()) trend.per_window = numeric::median(std::move(slopes));
  return trend;
}

double judged_period(std::span<const double> pv, std::span<const double> co) {
  const double moves = movement_period(co, pv);
  const Oscillation cycle = find_time_scale(co).oscillation;
  return oscillates(cycle) && cycle.period < Limits::kShorter * moves ? cycle.period : moves;
}

namespace {

// Returns the first window at a limit, if CO is at one in more than a third of all samples;
// otherwise windows.size().
std::size_t saturated_window(std::span<const Diagnosis> windows) {
  std::size_t limited = 0;
  std::size_t complete = 0;
  for (const Diagnosis& d : windows) {
    limited += d.prepared.limited;
    complete += d.prepared.complete;
  }
  if (!mostly_limited(limited, complete)) return windows.size();
  const auto at = std::find_if(windows.begin(), windows.end(), [](const Diagnosis& d) {
    return d.prepared.gate == Gate::saturation;
  });
  return static_cast<std::size_t>(at - windows.begin());
}

}  // namespace

LoopVerdict judge_loop(std::span<const Diagnosis> windows) {
  LoopVerdict loop;
  double sum = 0.0;
  std::size_t judged = 0;
  for (const Diagnosis& d : windows) {
    if (!d.judged()) continue;
    sum += logit(d.probability);
    ++judged;
  }
  const auto count = [&](auto&& like) {
    return static_cast<std::size_t>(std::count_if(windows.begin(), windows.end(), like));
  };
  const auto first = [&](auto&& like) {
    const auto at = std::find_if(windows.begin(), windows.end(), like);
    return at == windows.end() ? 0 : static_cast<std::size_t>(at - windows.begin());
  };
  if (judged == 0) {
    // A cause named by a gate, or too little data in every window.
    const auto named = [](const Diagnosis& d) {
      return d.verdict == DiagnosisVerdict::other_cause;
    };
    loop.like = first(named);
    if (windows.empty()) return loop;
    loop.verdict = windows[loop.like].verdict;
    loop.cause = windows[loop.like].cause;
    loop.reason = windows[loop.like].reason;
    loop.settle = windows[loop.like].settle;
    return loop;
  }
  loop.probability = from_logit(sum / static_cast<double>(judged));
  const auto effect = [](const Diagnosis& d) {
    return d.verdict == DiagnosisVerdict::valve_effect;
  };
  const auto undecided = [](const Diagnosis& d) {
    return d.verdict == DiagnosisVerdict::cant_tell;
  };
  const auto other = [](const Diagnosis& d) {
    return d.judged() && d.verdict == DiagnosisVerdict::other_cause;
  };
  if (loop.probability >= Limits::kDecidedFrom && count(effect) > 0) {
    const auto seen = [](const Diagnosis& d) { return d.grade == Grade::seen; };
    loop.verdict = DiagnosisVerdict::valve_effect;
    loop.grade = 2 * count(seen) >= count(effect) ? Grade::seen : Grade::likely;
    loop.testable = loop.grade == Grade::likely;
    double stiction = 0.0;  // nats
    for (const Diagnosis& d : windows) {
      if (effect(d)) stiction += logit(std::clamp(d.stiction_share, 0.01, 0.99));
    }
    loop.cause = stiction >= 0.0 ? Cause::stiction : Cause::backlash;
    // The last window with the loop's grade and cause represents the loop, because its size is the
    // present one.
    for (const bool same_cause : {false, true}) {
      for (std::size_t i = 0; i < windows.size(); ++i) {
        if (windows[i].grade == loop.grade && (!same_cause || windows[i].cause == loop.cause)) {
          loop.like = i;
        }
      }
    }
    std::size_t last = windows.size();
    while (last > 0 && !effect(windows[last - 1])) --last;
    loop.since = last - 1;
    for (std::size_t i = last; i-- > 0;) {
      if (effect(windows[i])) loop.since = i;
      if (windows[i].judged() && windows[i].probability < 0.5) break;
    }
  } else if (const auto at = saturated_window(windows); at < windows.size()) {
    loop.verdict = DiagnosisVerdict::other_cause;
    loop.cause = Cause::saturation;
    loop.like = at;
  } else if (loop.probability > Limits::kDecidedBelow) {
    loop.verdict = DiagnosisVerdict::cant_tell;
    loop.like = first(undecided);
    const Diagnosis& d = windows[loop.like];
    loop.reason = undecided(d) ? d.reason : "the windows of the loop contradict each other";
    loop.settle = undecided(d) ? d.settle : "more windows of the same loop in its present state";
    loop.testable = d.testable;
  } else if (2 * count(other) >= judged) {
    loop.verdict = DiagnosisVerdict::other_cause;
    loop.like = first(other);
    loop.cause = windows[loop.like].cause;
  } else {
    loop.verdict = DiagnosisVerdict::healthy;
    loop.like = first([](const Diagnosis& d) { return d.verdict == DiagnosisVerdict::healthy; });
  }
  return loop;
}

}  // namespace loopwarden::diagnosis
