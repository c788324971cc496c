// SPDX-License-Identifier: Apache-2.0
#include "model/watch/routine_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/diagnosis/limits.hpp"
#include "model/analysis/limits.hpp"
#include "model/watch/limits.hpp"

namespace loopwarden::watch {
namespace {

double logit(double p) noexcept {
  const double within = std::clamp(p, Limits::kLeastProbability, 1.0 - Limits::kLeastProbability);
  return std::log(within / (1.0 - within));
}

bool speaks(diagnosis::DiagnosisVerdict verdict) noexcept {
  switch (verdict) {
    case diagnosis::DiagnosisVerdict::valve_effect:
    case diagnosis::DiagnosisVerdict::other_cause:
    case diagnosis::DiagnosisVerdict::healthy: return true;
    case diagnosis::DiagnosisVerdict::not_enough_data:
    case diagnosis::DiagnosisVerdict::cant_tell: break;
  }
  return false;
}

// Returns whether the band is that of a healthy valve.
bool is_small(const RoutineWatch::Judgement& judgement) noexcept {
  return judgement.verdict == diagnosis::DiagnosisVerdict::valve_effect &&
         judgement.severity_percent < Limits::kHealthyBand;
}

// Returns whether two windows as one record suffice. `lowest`: the lower of their single
// probabilities.
bool raises(const RoutineWatch::Judgement& both, double lowest) noexcept {
  if (both.verdict != diagnosis::DiagnosisVerdict::valve_effect || is_small(both) || !both.whole) {
    return false;
  }
  const bool likely_stiction = both.fault == alarm::AlarmKind::stiction && lowest >= 0.5 &&
                               both.evidence.standing > diagnosis::DiagnosisLimits::kStandsFrom;
  return both.grade == diagnosis::Grade::seen || likely_stiction;
}

}  // namespace

RoutineWatch::Judgement judge_routine(const numeric::LoopView& record,
                                      const diagnosis::Archived& source) {
  diagnosis::Diagnosis found = diagnosis::diagnose(record);
  const double span = record.co_high - record.co_low;
  const double sees_from = diagnosis::sees_from(record.pv, record.co, source);
  if (source.any()) diagnosis::mind_archive(found, sees_from, span);
  RoutineWatch::Judgement judgement{
      .window_s = record.period_s * static_cast<double>(record.size()),
      .whole = found.prepared.used == record.pv.size(),
      .verdict = found.verdict,
      .grade = found.grade,
      .probability = found.probability,
      .evidence = found.evidence,
      .source = source,
      .sees_from_percent = span > 0.0 ? 100.0 * sees_from / span : 0.0};
  if (found.verdict == diagnosis::DiagnosisVerdict::valve_effect) {
    judgement.fault = found.cause == diagnosis::Cause::backlash ? alarm::AlarmKind::backlash
                                                                : alarm::AlarmKind::stiction;
    judgement.severity_percent = span > 0.0 ? 100.0 * found.s / span : 0.0;
  }
  return judgement;
}

RoutineWatch::RoutineWatch(const WindowSettings& settings)
    : has_set_point_(settings.has_set_point),
      on_change_(settings.on_change),
      co_low_(settings.co_low),
      co_high_(settings.co_high) {
  const double cycle_s = settings.sample_time_s > 0.0 ? settings.sample_time_s : 0.1;
  for (const double wanted_s : Limits::kRoutineSampleTimes_s) {
    const auto decimation = static_cast<std::size_t>(std::max(1.0, std::round(wanted_s / cycle_s)));
    if (!levels_.empty() && levels_.back().decimation == decimation) continue;
    Level& level = levels_.emplace_back();
    level.decimation = decimation;
    level.sample_time_s = static_cast<double>(decimation) * cycle_s;
    level.pv.resize(2 * Limits::kRoutineSamples);
    level.co.resize(2 * Limits::kRoutineSamples);
  }
}

void RoutineWatch::leave_out(Level& level, std::uint64_t cycles, bool manual) noexcept {
  const std::uint64_t longest = Limits::kLongestBreak * level.decimation;
  level.left_out = static_cast<std::size_t>(std::min(longest, level.left_out + cycles));
  if (level.left_out < longest) return;
  level.sp.clear();
  level.count = 0;
  level.has_before = level.full = false;
  level.in_sample = 0;
  level.sum_sp = level.sum_pv = level.sum_co = 0.0;
  level.from_specialists = 0.0;
  level.specialist_windows = 0;
  // In manual the valve may have been repaired: earlier evidence is dropped, but an active
  // condition must be refuted.
  if (manual) level.sum = level.on ? std::min(level.sum, Limits::kRaise) : 0.0;
}

bool RoutineWatch::take(Level& level, const Cycle& cycle) {
  level.left_out = 0;
  level.sum_sp += cycle.sp;
  level.sum_pv += cycle.pv;
  level.sum_co += cycle.co;
  if (++level.in_sample < level.decimation) return false;
  if (std::exchange(level.full, false)) {
    for (std::vector<float>* column : {&level.pv, &level.co}) {
      std::copy_n(column->begin() + Limits::kRoutineSamples, Limits::kRoutineSamples,
                  column->begin());
    }
    level.sp.keep_newest(Limits::kRoutineSamples);
    level.has_before = true;
  }
  const double n = static_cast<double>(level.in_sample);
  const std::size_t at = Limits::kRoutineSamples + level.count;
  level.sp.push(static_cast<float>(level.sum_sp / n));
  level.pv[at] = static_cast<float>(level.sum_pv / n);
  level.co[at] = static_cast<float>(level.sum_co / n);
  level.in_sample = 0;
  level.sum_sp = level.sum_pv = level.sum_co = 0.0;
  return ++level.count == Limits::kRoutineSamples;
}

bool RoutineWatch::add(const Cycle& cycle) {
  const std::uint64_t missing =
      any_ && cycle.period_index > last_period_ ? cycle.period_index - last_period_ - 1 : 0;
  any_ = true;
  last_period_ = cycle.period_index;
  const bool usable = cycle.automatic && cycle.pv_good && std::isfinite(cycle.pv) &&
                      std::isfinite(cycle.co) && (std::isfinite(cycle.sp) || !has_set_point_);
  bool judged = false;
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    Level& level = levels_[i];
    if (missing > 0) leave_out(level, missing, false);
    if (!usable) {
      leave_out(level, 1, !cycle.automatic);
    } else if (take(level, cycle)) {
      const Judgement of_level = judge(level);
      // Of several judgements at once, the one with the largest sum is used.
      if (!judged || of_level.sum > judgement_.sum) {
        judgement_ = of_level;
        judged_ = i;
        judged_samples_ =
            static_cast<std::size_t>(std::lround(of_level.window_s / levels_[i].sample_time_s));
      }
      judged = true;
    }
  }
  if (judged) settle_conditions();
  return judged;
}

RoutineWatch::Samples RoutineWatch::samples() const {
  return samples_of(levels_[judged_], judged_samples_);
}

RoutineWatch::Samples RoutineWatch::samples_of(const Level& level, std::size_t count) {
  const auto newest = [count](const std::vector<float>& column) {
    return std::span<const float>(column).last(count);
  };
  return {.period_s = level.sample_time_s,
          .pv = newest(level.pv),
          .co = newest(level.co),
          .sp = level.sp.newest(count)};
}

RoutineWatch::Levels RoutineWatch::levels() const noexcept {
  Levels all;
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    const Level& level = levels_[i];
    all[i] = {.window_s = level.sample_time_s * static_cast<double>(Limits::kRoutineSamples),
              .filled_s = level.sample_time_s * static_cast<double>(level.count),
              .windows = level.windows,
              .sum = level.sum,
              .probability = level.newest.probability,
              .verdict = level.newest.verdict,
              .fault = level.newest.fault,
              .severity_percent = level.newest.severity_percent};
  }
  return all;
}

void RoutineWatch::restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept {
  conditions_[index_of(kind)] = {on, severity_percent};
  restored_[index_of(kind)] = {on, severity_percent};
}

void RoutineWatch::specialists(const alarm::WindowJudgement& judgement) noexcept {
  if (judgement.result == alarm::WindowJudgement::Result::not_enough_movement) return;
  const double p = judgement.probability[index_of(alarm::AlarmKind::stiction)] +
                   judgement.probability[index_of(alarm::AlarmKind::backlash)] +
                   judgement.probability[index_of(alarm::AlarmKind::hysteresis)];
  for (Level& level : levels_) {
    level.from_specialists += p;
    ++level.specialist_windows;
  }
}

// Judges the newest `count` samples.
RoutineWatch::Judgement RoutineWatch::judge_newest(const Level& level, std::size_t count) const {
  const Samples newest = samples_of(level, count);
  const std::vector<double> sp(newest.sp.begin(), newest.sp.end());
  const std::vector<double> pv(newest.pv.begin(), newest.pv.end());
  const std::vector<double> co(newest.co.begin(), newest.co.end());
  return judge_routine(
      {.period_s = level.sample_time_s,
       .pv = pv,
       .sp = has_set_point_ ? std::span<const double>(sp) : std::span<const double>(),
       .co = co,
       .co_low = co_low_,
       .co_high = co_high_},
      source_);
}

RoutineWatch::Judgement RoutineWatch::judge(Level& level) {
  if (on_change_ && &level == levels_.data()) learn(level);
  Judgement judgement = judge_newest(level, Limits::kRoutineSamples);
  const double probability_before = std::exchange(level.probability, judgement.probability);
  const double sum_before = level.sum;
  double from_specialists = 0.0;
  if (level.specialist_windows > 0) {
    const double mean = level.from_specialists / static_cast<double>(level.specialist_windows);
    from_specialists =
        std::clamp(0.5 * logit(mean), -Limits::kMostFromSpecialists, Limits::kMostFromSpecialists);
  }
  if (speaks(judgement.verdict)) {
    const bool small = is_small(judgement);
    const double of_alarm = small ? 1.0 - judgement.probability : judgement.probability;
    level.sum = std::clamp(level.sum + logit(of_alarm) + from_specialists - Limits::kDrift, 0.0,
                           Limits::kMostEvidence);
  }
  if (level.has_before && from_specialists >= 0.0) {
    const Judgement both = judge_newest(level, 2 * Limits::kRoutineSamples);
    if (raises(both, std::min(probability_before, level.probability))) {
      judgement = both;
      level.sum = std::max(level.sum, Limits::kRaise);
    }
  }
  if (judgement.verdict == diagnosis::DiagnosisVerdict::valve_effect && !is_small(judgement)) {
    level.fault = judgement.fault;
    level.severity_percent = judgement.severity_percent;
  }
  if (level.sum >= Limits::kRaise) level.on = true;
  if (level.sum <= Limits::kClear && speaks(judgement.verdict)) {
    level.on = false;
    restored_ = {};
  }
  judgement.sum_before = sum_before;
  judgement.from_specialists = speaks(judgement.verdict) ? from_specialists : 0.0;
  judgement.sum = level.sum;
  judgement.fault = level.fault;
  judgement.severity_percent = level.severity_percent;
  level.newest = judgement;
  ++level.windows;
  level.full = true;
  level.count = 0;
  level.from_specialists = 0.0;
  level.specialist_windows = 0;
  return judgement;
}

void RoutineWatch::learn(const Level& level) {
  const Samples newest = samples_of(level, Limits::kRoutineSamples);
  const std::vector<double> pv(newest.pv.begin(), newest.pv.end());
  const std::vector<double> co(newest.co.begin(), newest.co.end());
  const auto learn_of = [](std::span<const double> values, analysis::ArchivedSignal& kept) {
    const analysis::ArchivedSignal found = analysis::recognise_filled(values);
    std::size_t anew = 0;
    for (std::size_t i = 1; i < values.size(); ++i) anew += values[i] != values[i - 1] ? 1U : 0U;
    const bool comes_anew =
        static_cast<double>(anew) > Limits::kMostAreNew * static_cast<double>(values.size());
    if (found.kind != analysis::ArchiveKind::none || comes_anew) {
      kept = found;
    } else if (anew > 0 && anew < analysis::Limits::kLeastStored) {
      kept = {.kind = analysis::ArchiveKind::unknown};
    }
  };
  learn_of(pv, source_.pv);
  learn_of(co, source_.co);
}

void RoutineWatch::settle_conditions() noexcept {
  conditions_ = restored_;
  for (const Level& level : levels_) {
    if (!level.on) continue;
    alarm::AlarmCondition& condition = conditions_[index_of(level.fault)];
    condition.on = true;
    condition.severity_percent = std::max(condition.severity_percent, level.severity_percent);
  }
}

}  // namespace loopwarden::watch
