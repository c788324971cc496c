// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/routine_watch.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::monitor {
namespace {

constexpr double kLeastProbability = 0.05;  // no single window is worth more than 2.9 nats

double logit(double p) noexcept {
  const double within = std::clamp(p, kLeastProbability, 1.0 - kLeastProbability);
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

}  // namespace

RoutineWatch::Judgement judge_routine(const diagnosis::RoutineRecord& record,
                                      const diagnosis::Archived& source) {
  diagnosis::Diagnosis found = diagnosis::diagnose(record);
  const double span = record.co_high - record.co_low;
  const double sees_from = diagnosis::sees_from(record.pv, record.co, source);
  if (source.any()) diagnosis::mind_archive(found, source, sees_from, span);
  RoutineWatch::Judgement judgement{
      .window_s = record.sample_time_s * static_cast<double>(record.pv.size()),
      .verdict = found.verdict,
      .grade = found.grade,
      .probability = found.probability,
      .evidence = found.evidence,
      .source = source,
      .sees_from_percent = span > 0.0 ? 100.0 * sees_from / span : 0.0};
  if (found.verdict == diagnosis::DiagnosisVerdict::valve_effect) {
    judgement.fault =
        found.cause == diagnosis::Cause::backlash ? AlarmKind::backlash : AlarmKind::stiction;
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
  for (const double wanted_s : kSampleTimes) {
    const auto decimation = static_cast<std::size_t>(std::max(1.0, std::round(wanted_s / cycle_s)));
    if (!levels_.empty() && levels_.back().decimation == decimation) continue;
    Level& level = levels_.emplace_back();
    level.decimation = decimation;
    level.sample_time_s = static_cast<double>(decimation) * cycle_s;
    level.sp.resize(kSamples);
    level.pv.resize(kSamples);
    level.co.resize(kSamples);
  }
}

void RoutineWatch::leave_out(Level& level, std::uint64_t cycles, bool manual) noexcept {
  const std::uint64_t longest = kLongestBreak * level.decimation;
  level.left_out = static_cast<std::size_t>(std::min(longest, level.left_out + cycles));
  if (level.left_out < longest) return;
  level.count = 0;
  level.in_sample = 0;
  level.sum_sp = level.sum_pv = level.sum_co = 0.0;
  level.from_specialists = 0.0;
  level.specialist_windows = 0;
  // In manual the valve may have been worked on: what was seen counts no more, but what is raised must be refuted.
  if (manual) level.sum = level.on ? std::min(level.sum, kRaise) : 0.0;
}

bool RoutineWatch::take(Level& level, const Cycle& cycle) noexcept {
  level.left_out = 0;
  level.sum_sp += cycle.sp;
  level.sum_pv += cycle.pv;
  level.sum_co += cycle.co;
  if (++level.in_sample < level.decimation) return false;
  const double n = static_cast<double>(level.in_sample);
  level.sp[level.count] = static_cast<float>(level.sum_sp / n);
  level.pv[level.count] = static_cast<float>(level.sum_pv / n);
  level.co[level.count] = static_cast<float>(level.sum_co / n);
  level.in_sample = 0;
  level.sum_sp = level.sum_pv = level.sum_co = 0.0;
  return ++level.count == kSamples;
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
      // Of several at once the one that says most.
      if (!judged || of_level.sum > judgement_.sum) {
        judgement_ = of_level;
        judged_ = i;
      }
      judged = true;
    }
  }
  if (judged) settle_conditions();
  return judged;
}

RoutineWatch::Samples RoutineWatch::samples() const noexcept {
  const Level& level = levels_[judged_];
  return {.sample_time_s = level.sample_time_s, .sp = level.sp, .pv = level.pv, .co = level.co};
}

void RoutineWatch::restore(AlarmKind kind, bool on, double severity_percent) noexcept {
  conditions_[index_of(kind)] = {on, severity_percent};
  restored_[index_of(kind)] = {on, severity_percent};
}

void RoutineWatch::specialists(const WindowJudgement& judgement) noexcept {
  if (judgement.result == WindowJudgement::Result::not_enough_movement) return;
  const double p = judgement.probability[index_of(AlarmKind::stiction)] +
                   judgement.probability[index_of(AlarmKind::backlash)] +
                   judgement.probability[index_of(AlarmKind::hysteresis)];
  for (Level& level : levels_) {
    level.from_specialists += p;
    ++level.specialist_windows;
  }
}

RoutineWatch::Judgement RoutineWatch::judge(Level& level) {
  const std::vector<double> sp(level.sp.begin(), level.sp.end());
  const std::vector<double> pv(level.pv.begin(), level.pv.end());
  const std::vector<double> co(level.co.begin(), level.co.end());
  if (on_change_ && &level == levels_.data()) learn(pv, co);
  Judgement judgement =
      judge_routine({.pv = pv,
                     .co = co,
                     .sp = has_set_point_ ? std::span<const double>(sp) : std::span<const double>(),
                     .sample_time_s = level.sample_time_s,
                     .co_low = co_low_,
                     .co_high = co_high_},
                    source_);
  judgement.sum_before = level.sum;
  if (speaks(judgement.verdict)) {
    if (level.specialist_windows > 0) {
      const double mean = level.from_specialists / static_cast<double>(level.specialist_windows);
      judgement.from_specialists =
          std::clamp(0.5 * logit(mean), -kMostFromSpecialists, kMostFromSpecialists);
    }
    const bool effect = judgement.verdict == diagnosis::DiagnosisVerdict::valve_effect;
    const bool small = effect && judgement.severity_percent < kHealthyBand;
    const double of_alarm = small ? 1.0 - judgement.probability : judgement.probability;
    level.sum =
        std::clamp(level.sum + logit(of_alarm) + judgement.from_specialists - kDrift, 0.0, kMost);
    if (effect && !small) {
      level.fault = judgement.fault;
      level.severity_percent = judgement.severity_percent;
    }
    if (level.sum >= kRaise) level.on = true;
    if (level.sum <= kClear) {
      level.on = false;
      restored_ = {};
    }
  }
  judgement.sum = level.sum;
  judgement.fault = level.fault;
  judgement.severity_percent = level.severity_percent;
  level.count = 0;
  level.from_specialists = 0.0;
  level.specialist_windows = 0;
  return judgement;
}

void RoutineWatch::learn(std::span<const double> pv, std::span<const double> co) {
  constexpr double kMostAreNew = 0.5;        // of the samples
  constexpr std::size_t kFewestStored = 20;  // stored values that a rule is recognised by
  const auto learn_of = [](std::span<const double> values, analysis::ArchivedSignal& kept) {
    const analysis::ArchivedSignal found = analysis::recognise_filled(values);
    std::size_t anew = 0;
    for (std::size_t i = 1; i < values.size(); ++i) anew += values[i] != values[i - 1] ? 1U : 0U;
    const bool comes_anew =
        static_cast<double>(anew) > kMostAreNew * static_cast<double>(values.size());
    if (found.kind != analysis::ArchiveKind::none || comes_anew) {
      kept = found;
    } else if (anew > 0 && anew < kFewestStored) {
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
    AlarmCondition& condition = conditions_[index_of(level.fault)];
    condition.on = true;
    condition.severity_percent = std::max(condition.severity_percent, level.severity_percent);
  }
}

}  // namespace loopwarden::monitor
