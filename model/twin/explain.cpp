// SPDX-License-Identifier: Apache-2.0
#include "model/twin/explain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "model/twin/commission.hpp"
#include "model/twin/since_change.hpp"
#include "model/effects/catalogue.hpp"
#include "model/gap/prove.hpp"
#include "model/watch/controller_watch.hpp"
#include "model/alarm/given_name.hpp"
#include "model/watch/twin_watch.hpp"

namespace loopwarden::twin {
namespace {

using alarm::AlarmKind;

constexpr double kHardlyLess = 8.0;

// What the twin's watches held at each sample of a stretch.
struct Held {
  std::array<std::vector<watch::TwinWatch::Sample>, watch::kTwinChanges> changes;
  std::vector<double> controller;  // n^2, CO units squared
};

// Of the samples at which a change may have begun the earliest at which it is hardly less likely
// than at the likeliest, and that. `ratio(k)`: twice the logarithm of the likelihood of a change at
// k. Nothing: none is likely.
std::optional<ChangeMoment> most_likely(std::size_t samples,
                                        const std::function<double(std::size_t)>& ratio) {
  std::vector<double> ratios(samples);
  for (std::size_t k = samples; k-- > 0;) ratios[k] = ratio(k);
  const auto most = std::max_element(ratios.begin(), ratios.end());
  if (most == ratios.end() || *most <= 0.0) return std::nullopt;
  const auto first =
      std::find_if(ratios.begin(), ratios.end(), [&](double r) { return r > *most - kHardlyLess; });
  return ChangeMoment{static_cast<std::size_t>(first - ratios.begin()),
                      static_cast<std::size_t>(most - ratios.begin())};
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

// A change of the twin goes before what the workflow finds in the stretch alone, where it closes
// most of the gap, or more than that. Controller output stands beside it. `first`: sample at
// which its record begins.
void take_over(Explanation& out, SinceChange&& since, std::size_t first) {
  gap::Result& result = out.result;
  if (!result.check.usable || since.effects.empty()) return;
  const bool found = result.outcome == gap::Outcome::missing_effect;
  if (since.closed < kClosed && found && !(out.closed < since.closed)) return;
  std::erase_if(result.effects,
                [](const auto& effect) { return effect.block != effects::Block::controller; });
  result.effects.insert(result.effects.begin(), since.effects.begin(), since.effects.end());
  result.outcome = gap::Outcome::missing_effect;
  result.sentence = since.effects.front().evidence;
  result.corrected = std::move(since.corrected);
  result.remainder.reset();
  out.closed = since.closed;
  out.at = first + since.at;
  out.from = {first + since.from.begin, first + since.from.end};
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
  if (watch.on()) moment = where_changed(seen.changes[static_cast<std::size_t>(leading)]);
  if (!watch.on() && controller.on()) moment = where_retuned(seen.controller);
  const std::size_t likeliest = stretch.begin + (moment ? moment->likeliest : 0);
  if (moment) stretch.begin += moment->earliest;
  // What came before the alarm may be too little to tell: then the minutes behind it are waited
  // for.
  stretch.end =
      std::min(record.size(), std::max(stretch.end, stretch.begin + samples(settings.enough_s)));
  return {stretch, likeliest};
}

Explanation explain(const numeric::LoopRecord& record, const plant::LoopModel& twin,
                    std::size_t alarm, const ExplainSettings& settings,
                    const gap::ParallelFor& parallel) {
  Explanation out;
  const TellingStretch telling = telling_stretch(record, twin, alarm, settings);
  const numeric::LoopRecord judged = record.has_co() ? judged_part(record, twin) : record;
  out.stretch = telling.range;
  out.stretch.begin = first_pv(judged, out.stretch.begin, out.stretch.end);
  out.at = out.stretch.begin;
  numeric::LoopRecord newest = judged.part(out.stretch.begin, out.stretch.end);
  newest.stem.clear();
  gap::Options options;
  if (!settings.judge_controller) options.search.without = {"controller_mismatch"};
  out.result = gap::find_gap(newest, twin, options, parallel, [](double) {});
  out.closed = gap::gap_closed(out.result.before.holdout_rmse, out.result.after.holdout_rmse,
                               out.result.floor.rmse());
  const auto before = static_cast<std::size_t>(kBefore_s / record.period_s);
  const std::size_t from =
      first_pv(judged, out.stretch.begin - std::min(out.stretch.begin, before), out.stretch.begin);
  const ChangeMoment moment{out.stretch.begin - from,
                            std::max(telling.likeliest, out.stretch.begin) - from};
  take_over(out, since_change(judged.part(from, out.stretch.end), moment, twin, parallel), from);
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
