// SPDX-License-Identifier: Apache-2.0
#include "model/twin/explain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "model/twin/commission.hpp"
#include "model/twin/found_controller.hpp"
#include "model/effects/catalogue.hpp"
#include "model/estimator/estimate.hpp"
#include "model/gap/check.hpp"
#include "model/gap/model_run.hpp"
#include "model/gap/next_test.hpp"
#include "model/gap/prove.hpp"
#include "model/numeric/text.hpp"
#include "model/plant/loop_model.hpp"
#include "model/watch/controller_watch.hpp"
#include "model/alarm/given_name.hpp"
#include "model/watch/twin_watch.hpp"

namespace loopwarden::twin {
namespace {

using alarm::AlarmKind;

constexpr double kHardlyLess = 8.0;
constexpr double kUnseen_s = 180.0;  // a change shows when the stem, or SP, moves
constexpr double kDeviations = 2.0;  // of the twin's posterior
constexpr double kLeastProbability = 0.05;
constexpr double kNearlyClosed = 0.9;  // of the gap, by a name that leaves more than noise
constexpr double kMostInexact = 0.7;   // its confidence
constexpr std::size_t kMostCandidates = 12;
constexpr double kLeastBefore_s = 240.0;  // healthy samples that are fitted
constexpr double kAnswersBefore = 30.0;
constexpr double kLeastJudged = 0.5;     // of the samples
constexpr double kLeastAfter_s = 120.0;  // in which a moment can be found
// The least that a twin's process changes by itself.
constexpr plant::ProcessUncertainty kLeastUncertainty{
    .gain = 0.02, .time_constant = 0.04, .dead_time = 0.03};

// Of the record's samples.
struct ChangeMoment {
  std::size_t earliest = 0;
  std::size_t latest = 0;
};

// What the twin's watches held at each sample of a stretch.
struct Held {
  std::array<std::vector<watch::TwinWatch::Sample>, watch::kTwinChanges> changes;
  std::vector<double> controller;  // n^2, CO units squared
};

// The first and the last sample at which a change is hardly less likely to have begun than at the
// likeliest one. `ratio(k)`: twice the logarithm of the likelihood of a change at k. Nothing: none is
// likely.
std::optional<ChangeMoment> most_likely(std::size_t samples,
                                        const std::function<double(std::size_t)>& ratio) {
  std::vector<double> ratios(samples);
  for (std::size_t k = samples; k-- > 0;) ratios[k] = ratio(k);
  const auto most = std::max_element(ratios.begin(), ratios.end());
  if (most == ratios.end() || *most <= 0.0) return std::nullopt;
  const auto likely = [&](double r) { return r > *most - kHardlyLess; };
  const auto first = std::find_if(ratios.begin(), ratios.end(), likely);
  const auto last = std::find_if(ratios.rbegin(), ratios.rend(), likely);
  return ChangeMoment{static_cast<std::size_t>(first - ratios.begin()),
                      static_cast<std::size_t>(ratios.rend() - last) - 1};
}

// Where a change of the kind that leads began.
std::optional<ChangeMoment> where_changed(const std::vector<watch::TwinWatch::Sample>& samples) {
  double up = 0.0;
  double down = 0.0;
  return most_likely(samples.size(), [&](std::size_t k) {
    up += samples[k].up;
    down += samples[k].down;
    return down > 0.0 ? up * up / down : 0.0;
  });
}

// Where the controller's error became another one: two variances.
std::optional<ChangeMoment> where_retuned(const std::vector<double>& squares) {
  std::vector<double> before(squares.size() + 1, 0.0);
  for (std::size_t k = 0; k < squares.size(); ++k) before[k + 1] = before[k] + squares[k];
  const auto mean = [](double sum, std::size_t count) {
    return std::max(1e-12, sum / static_cast<double>(std::max<std::size_t>(count, 1)));
  };
  const std::size_t size = squares.size();
  const double all = static_cast<double>(size) * std::log(mean(before[size], size));
  return most_likely(size, [&](std::size_t k) {
    const double early = mean(before[k], k);
    const double late = mean(before[size] - before[k], size - k);
    if (late < early) return 0.0;
    return all - static_cast<double>(k) * std::log(early) -
           static_cast<double>(size - k) * std::log(late);
  });
}

// How far the process may be from the twin's before its change has a name.
plant::ProcessUncertainty uncertainty_of(const plant::LoopModel& twin) {
  plant::ProcessUncertainty out = kLeastUncertainty;
  if (!twin.twin) return out;
  for (std::size_t i = 0; i < twin.twin->parameters.size(); ++i) {
    const double within = kDeviations * std::sqrt(twin.twin->covariance[i][i]);
    const std::string& name = twin.twin->parameters[i];
    double& value = name == "gain"            ? out.gain
                    : name == "time_constant" ? out.time_constant
                                              : out.dead_time;
    value = std::max(value, within);
  }
  return out;
}

// Names that the record can't distinguish from `name`: they take its place in a hypothesis with
// about as much probability.
std::vector<std::string> alternatives_to(const std::string& name,
                                         const estimator::Estimate& found) {
  std::vector<std::string> chosen;
  for (std::size_t begin = 0; begin <= found.chosen.size();) {
    const std::size_t end = std::min(found.chosen.find('+', begin), found.chosen.size());
    chosen.push_back(found.chosen.substr(begin, end - begin));
    begin = end + 1;
  }
  std::erase(chosen, name);
  std::vector<std::string> out;
  for (const auto& [names, probability] : found.posterior) {
    if (probability < kLeastProbability) continue;
    std::vector<std::string> others = names;
    if (others.size() != chosen.size() + 1) continue;
    for (const std::string& shared : chosen) std::erase(others, shared);
    if (others.size() == 1 && others[0] != name && effects::find_effect(others[0]) != nullptr) {
      out.push_back(others[0]);
    }
  }
  // A bias that begins is a step.
  if (name == "step_disturbance") out.emplace_back("output_bias");
  return out;
}

// The columns of the record for pictures.
gap::Series series_of(const numeric::LoopRecord& record, const gap::CheckedRecord& checked,
                      const estimator::Estimate& found) {
  gap::Series s;
  for (std::size_t k = 0; k < record.size(); ++k) s.time_s.push_back(record.seconds_at(k));
  s.pv = checked.record.pv;
  if (record.has_sp()) s.sp = record.sp;
  s.co = checked.co;
  s.pv_before = found.pv_before;
  s.pv_after = found.pv_after;
  return s;
}

// Competition of changes of the twin in a part of the record.
class Changes {
 public:
  // `judged`: PV of the record, NaN where the twin may not judge.
  Changes(const numeric::LoopRecord& record, const plant::LoopModel& twin,
          const std::vector<double>& judged)
      : record_(record), twin_(twin), checked_(gap::check(record, twin)) {
    if (!checked_.quality.usable) return;
    double counts = 0.0;
    for (std::size_t k = 0; k < judged.size(); ++k) {
      if (!std::isfinite(judged[k])) checked_.used[k] = checked_.measured[k] = false;
      if (checked_.used[k]) counts += 1.0;
    }
    const double share = counts / static_cast<double>(judged.size());
    if (share >= kLeastJudged) return;
    checked_.quality.usable = false;
    checked_.quality.refusal = numeric::text(
        "The twin may judge only %.0f %% of the samples; at least %.0f %% are required. The others "
        "are outside the commissioned range",
        100.0 * share, 100.0 * kLeastJudged);
  }

  // `change`: samples of the part; zeros: no healthy samples are known.
  gap::Result find(const ChangeMoment& change, const numeric::ParallelFor& parallel,
                   Explanation& out) const {
    gap::Result result;
    result.check = checked_.quality;
    result.model = result.corrected = twin_;
    if (!result.check.usable) return result;
    plant::LoopModel model = twin_;
    model.sample_time_s = record_.period_s;
    model.uncertainty = uncertainty_of(twin_);
    model.scenario.faults.clear();
    estimator::Options options{.without = {"learned"}, .most_effects = 2};
    const std::size_t proof = (record_.size() - change.earliest) / 3;
    if (change.latest > 0) {
      const double earliest_s = record_.seconds_at(change.earliest);
      options.since = {std::max(0.5 * earliest_s, earliest_s - kUnseen_s),
                       record_.seconds_at(change.latest)};
    }
    options.fitted = record_.size() - proof;
    const estimator::Estimate found = estimator::estimate(
        {record_.period_s, checked_.co, checked_.pv, checked_.measured}, model, options, parallel);
    result.outcome = found.verdict == estimator::Verdict::missing_effect
                         ? gap::Outcome::missing_effect
                     : found.verdict == estimator::Verdict::no_gap ? gap::Outcome::no_gap
                                                                   : gap::Outcome::unexplained;
    result.closed_loop = checked_.closed_loop;
    result.floor = {.transmitter_rmse = found.noise_rms,
                    .load_rmse = std::sqrt(std::max(
                        0.0, found.floor * found.floor - found.noise_rms * found.noise_rms))};
    result.before =
        gap::misfit_of(checked_.pv, found.pv_before, checked_.used, options.fitted, found.floor);
    result.after =
        gap::misfit_of(checked_.pv, found.pv_after, checked_.used, options.fitted, found.floor);
    result.holdout_from_s = record_.seconds_at(options.fitted);
    result.series = series_of(record_, checked_, found);
    out.closed = gap::gap_closed(found.before.holdout, found.after.holdout, found.floor);
    std::vector<estimator::Found> effects = found.effects;
    const double nearly =
        gap::gap_closed(found.before.holdout, found.chosen_left.holdout, found.floor);
    if (effects.empty() && nearly >= kNearlyClosed) {
      // No law is exactly the plant's: what is left is more than noise, and little of the gap.
      effects = found.nearest;
      for (estimator::Found& effect : effects) {
        effect.confidence = std::min(effect.confidence, kMostInexact);
      }
      out.closed = nearly;
      result.outcome = gap::Outcome::missing_effect;
      result.after.training_rmse = found.chosen_left.training;
      result.after.holdout_rmse = found.chosen_left.holdout;
    }
    if (!effects.empty()) result.corrected = found.corrected;
    if (record_.has_sp()) plan_test(found, model, parallel, result);
    for (const estimator::Found& effect : effects) {
      result.effects.push_back(shown(effect, found, out.closed));
    }
    for (const estimator::Ranked& one : found.ranked) {
      if (result.candidates.size() < kMostCandidates)
        result.candidates.push_back(tried(one, found));
    }
    if (!effects.empty()) {
      const estimator::Interval moment = moment_of(effects.front());
      const auto sample = [&](double s) {
        return static_cast<std::size_t>(std::lround(std::max(0.0, s) / record_.period_s));
      };
      out.at = sample(moment.value);
      out.from = {sample(moment.within[0]), sample(moment.within[1])};
    }
    result.sentence = !result.effects.empty() ? result.effects.front().evidence
                      : result.outcome == gap::Outcome::no_gap
                          ? "The twin explains the record down to its noise."
                          : "The loop differs from its twin, and no effect explains how.";
    return result;
  }

 private:
  static estimator::Interval moment_of(const estimator::Found& effect) {
    const auto time = effect.intervals.find("time");
    return time == effect.intervals.end() ? effect.moment : time->second;
  }

  void plan_test(const estimator::Estimate& found, const plant::LoopModel& model,
                 const numeric::ParallelFor& parallel, gap::Result& result) const {
    const auto likeliest =
        std::find_if(found.ranked.begin(), found.ranked.end(),
                     [&](const estimator::Ranked& one) { return one.title == found.chosen; });
    estimator::TestStart start = gap::test_start(model, record_.sp.back(), checked_.co.back());
    if (likeliest != found.ranked.end()) start.disturbance = likeliest->error.disturbance;
    std::vector<gap::Probability> posterior;
    for (const estimator::Explanation& one : found.explanations) {
      posterior.push_back({one.effects, one.probability});
    }
    gap::plan_next_test(found, posterior, std::move(start), parallel, result);
  }

  gap::FoundEffect shown(const estimator::Found& effect, const estimator::Estimate& found,
                         double closed) const {
    gap::FoundEffect out;
    out.spec = effect.spec;
    out.block = effect.block;
    out.confidence = effect.confidence;
    out.alternatives = alternatives_to(effect.spec.name, found);
    for (const auto& [name, range] : effect.intervals) out.interval[name] = range.within;
    const double end_s = record_.seconds_at(record_.size());
    const estimator::Interval moment = moment_of(effect);
    const bool since = moment.value > 0.0;
    out.evidence = numeric::text(
        "Explanation: %s%s. It accounts for %.0f %% of the deviation on the last third of the "
        "data, "
        "which chose nothing.",
        out.spec.name.c_str(),
        since ? numeric::text(", since %.0f s before the last sample (%.0f to %.0f s)",
                              end_s - moment.value, end_s - moment.within[1],
                              end_s - moment.within[0])
                    .c_str()
              : "",
        100.0 * (std::isfinite(closed) ? closed : found.closed));
    return out;
  }

  gap::TriedCandidate tried(const estimator::Ranked& one, const estimator::Estimate& found) const {
    gap::TriedCandidate out;
    out.name = one.title;
    out.rmse = one.left.training;
    out.score = one.score;
    out.chosen = one.title == found.chosen;
    if (!out.chosen) {
      out.why_not = numeric::text("%.0f nats behind", found.ranked.front().score - one.score);
    }
    return out;
  }

  const numeric::LoopRecord& record_;
  const plant::LoopModel& twin_;
  gap::CheckedRecord checked_;
};

// Adds the controller's settings in the stretch, if they are not the twin's. Without an explanation
// of the plant they count only if they give CO exactly.
void add_controller(const numeric::LoopRecord& stretch, const plant::LoopModel& twin,
                    gap::Result& result) {
  const std::optional<FoundController> found = other_controller(gap::check(stretch, twin));
  if (!found || !(found->exact || result.outcome != gap::Outcome::unexplained)) return;
  result.controller_before_rmse = found->before_rmse;
  result.controller_after_rmse = found->after_rmse;
  adopt(*found, result.corrected);
  if (result.effects.empty()) result.sentence = found->effect.evidence;
  result.outcome = gap::Outcome::missing_effect;
  result.effects.push_back(found->effect);
}

// The first effect, if it gives its name.
const gap::FoundEffect* sure_effect(const Explanation& e) {
  if (e.result.outcome != gap::Outcome::missing_effect || e.result.effects.empty()) return nullptr;
  const gap::FoundEffect& first = e.result.effects.front();
  return alarm::gives_name(first.spec.name, first.confidence, e.closed, false) ? &first : nullptr;
}

// The record without PV where the twin may not judge: from beyond the commissioned range until
// samples count again.
numeric::LoopRecord judged_part(numeric::LoopRecord record, const plant::LoopModel& twin) {
  watch::TwinWatch watch(twin);
  double co = std::numeric_limits<double>::quiet_NaN();
  bool left_out = false;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (std::isfinite(record.co[k])) co = record.co[k];
    if (!std::isfinite(record.pv[k])) continue;
    watch.add(record.pv[k], co);
    left_out = !watch.inside() || (left_out && !watch.judged_here());
    if (left_out) record.pv[k] = std::numeric_limits<double>::quiet_NaN();
  }
  return record;
}

// The first sample from `from` on that has a PV; `end` if none has.
std::size_t first_pv(const numeric::LoopRecord& record, std::size_t from, std::size_t end) {
  while (from < end && !std::isfinite(record.pv[from])) ++from;
  return from;
}

}  // namespace

TellingStretch telling_stretch(const numeric::LoopRecord& record, const plant::LoopModel& twin,
                               std::size_t alarm, const ExplainSettings& settings) {
  const auto samples = [&](double seconds) {
    return static_cast<std::size_t>(seconds / record.period_s);
  };
  const std::size_t longest = samples(kLongest_s);
  gap::SampleRange stretch{alarm > longest ? alarm - longest : 0,
                           std::min(record.size(), alarm + 1)};
  if (!record.has_co()) return {stretch, stretch.begin};
  watch::TwinWatch watch(twin);
  watch::ControllerWatch controller(twin);
  Held seen;
  watch::TwinChange leading = watch::TwinChange::gain;
  double largest = 0.0;
  double co = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = stretch.begin; k < stretch.end; ++k) {
    // CO of a missing cycle is the last one, as for the watch that raised the alarm.
    const bool missing = !std::isfinite(record.co[k]);
    if (!missing) co = record.co[k];
    watch.add(record.pv[k], co);
    for (std::size_t i = 0; i < watch::kTwinChanges; ++i) {
      seen.changes[i].push_back(watch.newest(static_cast<watch::TwinChange>(i)));
    }
    if (missing) controller.restart();
    if (!missing && record.has_sp() && settings.judge_controller) {
      controller.add(record.sp[k], record.pv[k], record.co[k]);
    }
    seen.controller.push_back(controller.apart() * controller.apart());
    if (watch.largest() <= largest) continue;
    largest = watch.largest();
    leading = watch.leading();
  }
  std::optional<ChangeMoment> moment;
  // A watch that starts later than the one that raised the alarm may be below its limit.
  if (!watch.on() && controller.on()) {
    moment = where_retuned(seen.controller);
  } else {
    moment = where_changed(seen.changes[static_cast<std::size_t>(leading)]);
  }
  const std::size_t latest = moment ? stretch.begin + moment->latest : alarm;
  if (moment) stretch.begin += moment->earliest;
  // What came before the alarm may be too little to tell: then the minutes behind it are waited
  // for.
  stretch.end =
      std::min(record.size(), std::max(stretch.end, stretch.begin + samples(settings.enough_s)));
  return {stretch, latest};
}

Explanation explain(const numeric::LoopRecord& record, const plant::LoopModel& twin,
                    std::size_t alarm, const ExplainSettings& settings,
                    const numeric::ParallelFor& parallel) {
  Explanation out;
  const TellingStretch telling = telling_stretch(record, twin, alarm, settings);
  const numeric::LoopRecord judged = record.has_co() ? judged_part(record, twin) : record;
  out.stretch = telling.range;
  out.stretch.begin = first_pv(judged, out.stretch.begin, out.stretch.end);
  out.at = out.stretch.begin;
  const auto samples = [&](double seconds) {
    return static_cast<std::size_t>(seconds / record.period_s);
  };
  const std::size_t before =
      samples(std::clamp(kAnswersBefore * plant::answer_s(twin), kLeastBefore_s, kBefore_s));
  const bool enough = out.stretch.end >= out.stretch.begin + samples(kLeastAfter_s);
  const std::size_t from =
      enough && record.has_co()
          ? first_pv(judged, out.stretch.begin - std::min(out.stretch.begin, before),
                     out.stretch.begin)
          : out.stretch.begin;
  numeric::LoopRecord part = record.part(from, out.stretch.end);
  part.stem.clear();
  const ChangeMoment moment{out.stretch.begin - from,
                            std::max(telling.latest, out.stretch.begin) - from};
  out.result =
      Changes(part, twin, judged.part(from, out.stretch.end).pv).find(moment, parallel, out);
  out.at = out.result.effects.empty() ? out.stretch.begin : from + out.at;
  if (out.from.end > 0) out.from = {from + out.from.begin, from + out.from.end};
  if (out.usable() && settings.judge_controller) {
    add_controller(record.part(out.stretch.begin, out.stretch.end), twin, out.result);
  }
  return out;
}

bool agrees(const Explanation& e, AlarmKind alarm) {
  return std::any_of(e.result.effects.begin(), e.result.effects.end(), [&](const auto& effect) {
    const effects::Descriptor* info = effects::find_word(effect.spec.name);
    if (effect.spec.name == "learned" && effect.block == effects::Block::valve &&
        alarm == AlarmKind::unknown) {
      return true;
    }
    return alarm == AlarmKind::model_gap ||
           (info != nullptr && effects::agrees(*info, alarm::to_text(alarm)));
  });
}

std::optional<AlarmKind> final_name(const Explanation& e, AlarmKind alarm) {
  const gap::FoundEffect* effect = sure_effect(e);
  if (effect == nullptr || agrees(e, alarm)) return std::nullopt;
  if (effect->block != effects::Block::valve) return AlarmKind::model_gap;
  const effects::Descriptor* info = effects::find_word(effect->spec.name);
  for (const AlarmKind kind : alarm::kWindowAlarms) {
    if (info != nullptr && !info->alarms.empty() && info->alarms.front() == alarm::to_text(kind)) {
      return kind;
    }
  }
  return AlarmKind::unknown;
}

double size_percent(const Explanation& e) {
  const gap::FoundEffect* effect = sure_effect(e);
  if (effect == nullptr) return 0.0;
  const control::PidSettings& pid = e.result.model.controller.pid;
  const double size = size_percent(effect->spec, pid.output_span());
  return std::isfinite(size) ? size : 0.0;
}

}  // namespace loopwarden::twin
