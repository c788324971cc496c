// SPDX-License-Identifier: Apache-2.0
#include "model/twin/commission.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "model/analysis/identification.hpp"
#include "model/twin/found_controller.hpp"
#include "model/twin/process_fit.hpp"
#include "model/twin/usable.hpp"
#include "model/effects/catalogue.hpp"
#include "model/estimator/constants.hpp"
#include "model/estimator/estimate.hpp"
#include "model/gap/check.hpp"
#include "model/gap/independence.hpp"
#include "model/gap/model_run.hpp"
#include "model/gap/prove.hpp"
#include "model/gap/record_check.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"
#include "model/watch/controller_watch.hpp"
#include "model/watch/limits.hpp"
#include "model/watch/load_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::twin {
namespace {

using effects::Block;
using gap::FoundEffect;
using numeric::text;
using plant::LoopModel;

// What the loop's own process does, and its level: moved, not named. A law without a name is no
// part of a twin.
const std::vector<std::string> kOfTheProcess{"gain_change", "extra_dead_time", "output_bias",
                                             "leakage", "learned"};
constexpr double kLoadTime_s = 300.0;  // a load that wanders is forgotten in this time
constexpr double kLeastSpMove =
    0.002;  // of the PV span: what is a move of SP in the twin's scenario
constexpr std::size_t kMostSpMoves = 400;
// What is left is none of the twin's business up to so many floors; from fewer on it is remarked.
constexpr double kLeastClosedByRound = 0.8;
constexpr double kFewFloors = 2.0;
constexpr double kRemarked = 1.5;
constexpr double kMatters = 0.5;  // of what is left: what follows SP or CO

bool of_the_day(const effects::EffectSpec& spec, Block block) {
  return block == Block::disturbance || spec.name == "drift";
}

// The quasi-static law: the twin's dead time contains the delay of its actuator.
effects::EffectSpec without_momentum(effects::EffectSpec spec) {
  const auto law = spec.options.find("law");
  if (law == spec.options.end() || law->second != "inertial") return spec;
  spec.options.erase(law);
  spec.parameters.erase("natural_frequency");
  spec.parameters.erase("damping");
  return spec;
}

bool is_curve(const effects::EffectSpec& spec) { return spec.name == "valve_characteristic"; }

bool has_curve(const LoopModel& model) {
  return std::any_of(model.valve_effects.begin(), model.valve_effects.end(), is_curve);
}

Spans spans_of(const LoopModel& model) {
  return {model.controller.pid.output_low, model.controller.pid.output_high, model.transmitter.low,
          model.transmitter.high};
}

Spans measured_spans(const numeric::LoopRecord& record) {
  const numeric::Range co = numeric::range_of(record.co);
  const numeric::Range pv = numeric::range_of(record.pv);
  return {co.low, co.high, pv.low, pv.high};
}

// The moves of SP as they were, for `simulate` and for training.
plant::Scenario scenario_of(const numeric::LoopRecord& record, const LoopModel& model) {
  plant::Scenario scenario;
  scenario.seed = 1;
  scenario.duration_s = static_cast<double>(record.size()) * record.period_s;
  double least = kLeastSpMove * model.transmitter.span();
  do {
    scenario.set_point.clear();
    for (std::size_t k = 0; record.has_sp() && k < record.size(); ++k) {
      const double sp = record.sp[k];
      if (!std::isfinite(sp)) continue;
      const double inside = std::clamp(sp, model.transmitter.low, model.transmitter.high);
      if (scenario.set_point.empty()) {
        scenario.set_point.emplace_back(0.0, inside);
      } else if (std::abs(inside - scenario.set_point.back().second) >= least && k > 0) {
        scenario.set_point.emplace_back(record.seconds_at(k), inside);
      }
    }
    least *= 2.0;
  } while (scenario.set_point.size() > kMostSpMoves);
  return scenario;
}

std::string words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

// Why the valve is not healthy; empty where the effect may be the twin's.
std::string why_not_healthy(const effects::EffectSpec& spec, Block block, const LoopModel& model,
                            double limit) {
  if (block != Block::valve) return "";
  const std::string& name = spec.name;
  if (name == "low_air_supply" || name == "cam_obstruction" || name == "intermittent_stiction") {
    return text("The valve is not healthy: %s. %s", words(name).c_str(),
                effects::find_effect(name)->remedy);
  }
  const double size = size_percent(spec, model.controller.pid.output_span());
  if (!(size > limit)) return "";
  return text("The valve is not healthy: %s of %.1f %% of span, at most %.1f %% is allowed. %s",
              words(name).c_str(), size, limit, effects::find_effect(name)->remedy);
}

class Commissioner {
 public:
  Commissioner(const Request& request, const numeric::ParallelFor& parallel,
               const std::function<void(double)>& progress)
      : request_(request),
        record_(request.records.front()),
        parallel_(parallel),
        progress_(progress) {}

  Commissioning run() {
    if (!usable() || !find_start()) return std::move(out_);
    build();
    return std::move(out_);
  }

 private:
  bool refuse(Outcome outcome, std::string why) {
    out_.outcome = outcome;
    out_.why = std::move(why);
    return false;
  }
  bool passes(Outcome outcome, std::string why) {
    return why.empty() || refuse(outcome, std::move(why));
  }

  bool usable() {
    if (!record_.has_co()) {
      if (!request_.accept_short || !request_.model) {
        return refuse(
            Outcome::not_usable,
            "The record has no CO, so the effects of valve and controller can't be separated. "
            "(With a model, use --accept-short to accept it.)");
      }
      out_.accepted.emplace_back("no_co");
    }
    if (!passes(Outcome::not_usable, why_compressed(record_)) ||
        !passes(Outcome::not_usable, why_by_hand(record_.automatic)) ||
        !passes(Outcome::not_usable, why_clamped(record_, spans()))) {
      return false;
    }
    if (const std::string why = why_short(record_); !why.empty()) {
      if (!request_.accept_short) return refuse(Outcome::not_enough_movement, why);
      out_.accepted.emplace_back("short");
    }
    // Without CO the model's own scenario says what moved.
    if (!record_.has_co() && !record_.has_sp()) return true;
    return passes(Outcome::not_enough_movement, why_still(record_, spans()));
  }

  // As the model has them, else as they are known, else as measured.
  Spans spans() const {
    if (request_.model) return spans_of(*request_.model);
    Spans spans = measured_spans(record_);
    if (const auto& co = request_.ranges.co) std::tie(spans.co_low, spans.co_high) = *co;
    if (const auto& pv = request_.ranges.pv) std::tie(spans.pv_low, spans.pv_high) = *pv;
    return spans;
  }

  // The model to start from, and how far its process may be off.
  bool find_start() {
    analysis::AssumedModel assumed;
    if (record_.has_co()) {
      try {
        numeric::LoopView loop = record_.view();
        loop.stem = {};
        assumed = analysis::assumed_model(loop, request_.ranges);
      } catch (const analysis::IdentificationError& e) {
        assumed.identification.reason = e.what();
      }
    }
    // A twin is of a healthy valve.
    if (assumed.identification.cycle) {
      assumed.identification.reason = "The valve sticks in this record.";
      assumed.model.reset();
    }
    if (!request_.model) {
      if (!assumed.model) {
        return refuse(Outcome::not_enough_movement,
                      assumed.identification.reason + " " + assumed.identification.settle);
      }
      out_.identified = true;
      out_.notes = assumed.assumptions;
      out_.given = *assumed.model;
      model_ = out_.given;
      model_.uncertainty = kIdentified;
      return true;
    }
    out_.given = *request_.model;
    model_ = out_.given;
    model_.uncertainty = kRoughBelief;
    if (!assumed.model || assumed.model->process.integrating() != model_.process.integrating()) {
      return true;
    }
    LoopModel other = out_.given;
    other.process = assumed.model->process;
    other.process.level = out_.given.process.level;
    const gap::CheckedRecord checked = gap::check(record_, out_.given);
    if (!checked.quality.usable) return true;  // build() gives the reason
    const FittedRecord fitted = fitted_part(checked, out_.given);
    if (follow_process(fitted, other).training_rmse <
        follow_process(fitted, model_).training_rmse) {
      other.uncertainty = kIdentified;
      model_ = std::move(other);
    }
    return true;
  }

  static FittedRecord fitted_part(const gap::CheckedRecord& checked, const LoopModel& model) {
    FittedRecord out{
        .observed = {checked.record.period_s, checked.co, checked.pv, checked.measured},
        .fitted = checked.training_end};
    out.noise_rms = estimator::noise_of(out.observed, out.fitted, model.transmitter.resolution,
                                        model.transmitter.span());
    out.level = model.process.level.value_or(0.0);
    return out;
  }

  void add_stage(std::string name, const ProcessFit& fit) {
    out_.stages.push_back({std::move(name), fit.training_rmse, fit.holdout_rmse, fit.pv});
  }

  // The competition of effects about the present model.
  estimator::Estimate compete(LoopModel model, const plant::ProcessUncertainty& about) const {
    model.sample_time_s = record_.period_s;
    model.uncertainty = about;
    model.disturbances.push_back(any_level(model));
    return estimator::estimate(fitted_.observed, model, {.without = kOfTheProcess}, parallel_);
  }

  // 1. The process, searched if the model is a rough belief.
  // 2. Effects, a competition in each round, and the process about them.
  // 3. Characteristic and friction of a healthy valve.
  void build() {
    checked_ = gap::check(record_, out_.given);
    if (!checked_.quality.usable) {
      refuse(Outcome::not_usable, checked_.quality.refusal);
      return;
    }
    fitted_ = fitted_part(checked_, out_.given);
    model_.sample_time_s = record_.period_s;
    if (const auto controller = other_controller(checked_)) {
      adopt(*controller, model_);
      out_.effects.push_back(controller->effect);
    }
    add_stage("as given", follow_process(fitted_, out_.given));
    if (model_.uncertainty == kRoughBelief) model_ = find_process(fitted_, model_);
    fit_ = fit_process(fitted_, model_);
    add_stage("process", fit_);
    estimator::Estimate last;
    bool challenged = false;
    const double share = 1.0 / static_cast<double>(kMostRounds + request_.records.size());
    for (int round = 0; round < kMostRounds; ++round) {
      last = compete(fit_.model, round == 0 ? kIdentified : kAbout);
      progress_(share * static_cast<double>(round + 1));
      // A characteristic that is not quite right makes faults of other forms: before a valve is
      // called faulty, the healthy effects are fitted without the fault.
      if (is_faulty(last)) {
        const bool alone = take_in(last).empty();
        if (challenged || alone) {
          for (const estimator::Found& effect : last.effects) {
            if (!is_healthy(effect)) show(effect);
          }
          finish(last);
          out_.outcome = Outcome::not_healthy;
          return;
        }
        challenged = true;
        continue;
      }
      const bool nearly = last.verdict == estimator::Verdict::unexplained &&
                          !last.nearest.empty() && explains_most(last);
      if (last.verdict != estimator::Verdict::missing_effect && !nearly) break;
      add_stage(take_in(last), fit_);
    }
    polish();
    judge(last);
    if (out_.outcome == Outcome::commissioned) prove_on_others(share);
    progress_(1.0);
  }

  // Says why.
  bool is_faulty(const estimator::Estimate& found) {
    const double limit = request_.healthy_limit_percent;
    for (const estimator::Found& effect : found.effects) {
      out_.why = why_not_healthy(effect.spec, effect.block, out_.given, limit);
      if (!out_.why.empty()) return true;
    }
    for (const estimator::Found& effect : found.nearest) {
      const std::string why = why_not_healthy(effect.spec, effect.block, out_.given, limit);
      if (why.empty()) continue;
      out_.why = why + " (No effect explains the whole record; this one is the nearest.)";
      return true;
    }
    return false;
  }

  // Whether the chosen hypothesis leaves little of the gap.
  static bool explains_most(const estimator::Estimate& found) {
    return gap::gap_closed(found.before.holdout, found.chosen_left.holdout, found.noise_rms) >=
           kLeastClosedByRound;
  }

  bool is_healthy(const estimator::Found& effect) const {
    return why_not_healthy(effect.spec, effect.block, out_.given, request_.healthy_limit_percent)
        .empty();
  }

  void show(const estimator::Found& effect) {
    // The curve of a later round replaces that of the one before.
    std::erase_if(out_.effects,
                  [&](const FoundEffect& e) { return e.spec.name == effect.spec.name; });
    FoundEffect& shown = out_.effects.emplace_back();
    shown.spec = without_momentum(effect.spec);
    shown.block = effect.block;
    shown.confidence = effect.confidence;
    for (const auto& [name, range] : effect.intervals) shown.interval[name] = range.within;
  }

  // Adds the effects that a healthy valve may have, and fits the process about them. Returns their
  // names.
  std::string take_in(const estimator::Estimate& found) {
    LoopModel next = fit_.model;
    std::string names;
    // A curve of another form explains nearly all, and is bent to the record then. Its error takes
    // the form of other effects, so they wait for the next round.
    const auto& chosen = found.effects.empty() ? found.nearest : found.effects;
    const bool curve = std::any_of(chosen.begin(), chosen.end(),
                                   [](const auto& effect) { return is_curve(effect.spec); });
    for (const estimator::Found& effect : chosen) {
      if (!is_healthy(effect) || (curve && !is_curve(effect.spec))) continue;
      add_effect(effect, next);
      names += (names.empty() ? "" : " and ") + words(effect.spec.name);
    }
    fit_ = fit_process(fitted_, next);
    // A curve explains part of many effects, so it is bent only if a characteristic is named.
    if (has_curve(next)) fit_ = bent(fitted_, std::move(fit_));
    return names;
  }

  void add_effect(const estimator::Found& effect, LoopModel& model) {
    const effects::EffectSpec spec = without_momentum(effect.spec);
    switch (effect.block) {
      case Block::valve: {
        std::erase_if(model.valve_effects, [&](const auto& s) { return s.name == spec.name; });
        const auto rank = [](const effects::EffectSpec& s) {
          return effects::find_effect(s.name)->valve_rank;
        };
        const auto after = std::find_if(model.valve_effects.begin(), model.valve_effects.end(),
                                        [&](const auto& s) { return rank(s) > rank(spec); });
        model.valve_effects.insert(after, spec);
        break;
      }
      case Block::process: model.process_effects.push_back(spec); break;
      case Block::transmitter: model.transmitter_effects.push_back(spec); break;
      case Block::disturbance: model.disturbances.push_back(spec); break;
      case Block::controller: break;
    }
    if (of_the_day(spec, effect.block)) {
      out_.notes.push_back(words(spec.name) +
                           ": a condition of that day, not of the loop; not included in the twin");
      day_.push_back(spec);
      return;
    }
    show(effect);
  }

  // Its points are solved for at the present curve, so it is bent until it stays.
  ProcessFit bent(const FittedRecord& record, ProcessFit fit) const {
    constexpr int kMostBends = 4;
    for (int i = 0; i < kMostBends && record_.has_co(); ++i) {
      ProcessFit next = bend_characteristic(record, fit);
      if (!(next.log_likelihood > fit.log_likelihood)) break;
      fit = std::move(next);
    }
    return fit;
  }

  double most_friction() const {
    if (!out_.given.has_valve || !record_.has_co()) return 0.0;
    return 0.01 * request_.healthy_limit_percent * out_.given.controller.pid.output_span();
  }

  // Characteristic and friction, which are too small to be called missing.
  void polish() {
    fit_ = bent(fitted_, std::move(fit_));
    double percent = 0.0;
    fit_ = add_friction(fitted_, fit_, most_friction(), percent);
    if (!(percent > 0.0)) return;
    out_.notes.push_back(
        text("healthy valve friction: %.2f %% of span (included in the twin)", percent));
    add_stage("friction", fit_);
  }

  // The twin from the fit, and what is left of the gap.
  void finish(const estimator::Estimate& last) {
    // The last third may be noisier.
    const double noise = std::max(fitted_.noise_rms, checked_.quality.noise_rms);
    // Of the fitted part: an error that only the last third has is no disturbance.
    const double load = disturbance_of(fitted_, fit_.pv);
    // A larger disturbance is something unexplained.
    const double largest = estimator::kLimits.largest_disturbance * out_.given.transmitter.span();
    const double of_load = load < largest ? load * std::sqrt(0.5 * kLoadTime_s) : 0.0;
    gap::Result result;
    result.check = checked_.quality;
    result.floor.transmitter_rmse = noise;
    result.floor.load_rmse = std::min(
        of_load, std::sqrt(std::max(0.0, fit_.holdout_rmse * fit_.holdout_rmse - noise * noise)));
    result.load_intensity = load;
    const double floor = result.floor.rmse();
    result.outcome = last.verdict == estimator::Verdict::unexplained ? gap::Outcome::unexplained
                     : out_.effects.empty()                          ? gap::Outcome::no_gap
                                                                     : gap::Outcome::missing_effect;
    result.model = out_.given;
    result.effects = out_.effects;
    add_stage("twin", fit_);
    result.before =
        gap::misfit_of(checked_.pv, out_.stages.front().pv, checked_.used, fitted_.fitted, floor);
    result.after = gap::misfit_of(checked_.pv, fit_.pv, checked_.used, fitted_.fitted, floor);
    result.holdout_from_s = record_.seconds_at(checked_.training_end);
    result.series.pv_before = out_.stages.front().pv;
    result.series.pv_after = fit_.pv;
    out_.closed = gap::gap_closed(result.before.holdout_rmse, result.after.holdout_rmse, floor);

    // The last third has proved the model: now it counts, too.
    FittedRecord whole = fitted_;
    whole.fitted = record_.size();
    ProcessFit all = fit_process(whole, fit_.model);
    if (has_curve(all.model)) all = bent(whole, std::move(all));
    LoopModel twin = all.model;
    twin.uncertainty = out_.given.uncertainty;
    if (out_.identified) twin.uncertainty = {};
    const auto is_of_the_day = [&](const effects::EffectSpec& spec) {
      return std::find(day_.begin(), day_.end(), spec) != day_.end();
    };
    std::erase_if(twin.disturbances, is_of_the_day);
    std::erase_if(twin.transmitter_effects, is_of_the_day);
    std::erase_if(twin.disturbances,
                  [](const effects::EffectSpec& spec) { return spec.name == "random_load"; });
    if (const double intensity = disturbance_of(whole, all.pv); intensity > 0.0) {
      twin.disturbances.push_back(
          {"random_load", {{"intensity", intensity}, {"time_constant", kLoadTime_s}}});
    }
    const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
    twin.transmitter.noise = std::sqrt(std::max(0.0, noise * noise - rounding * rounding));
    if (record_.has_sp()) twin.scenario = scenario_of(record_, twin);
    twin.twin = all.posterior;
    if (record_.has_co()) watch_healthy(twin);
    result.corrected = twin;
    out_.twin = std::move(twin);
    out_.gap = std::move(result);
  }

  // What the twin's watches have to bear: what the healthy record itself reaches.
  void watch_healthy(LoopModel& twin) const {
    plant::TwinFit& fit = *twin.twin;
    const Spans seen = measured_spans(record_);
    fit.seen_low = seen.pv_low;
    fit.seen_high = seen.pv_high;
    fit.co_low = seen.co_low;
    fit.co_high = seen.co_high;
    watch::TwinWatch watch(twin);
    watch::LoadWatch load(twin);
    const auto minute = static_cast<std::size_t>(watch::WatchLimits::kMinutes_s / record_.period_s);
    std::vector<double> loads;  // means over a minute
    plant::SeenLoad seen_load;
    std::size_t counted = 0;
    for (std::size_t k = 0; k < record_.size(); ++k) {
      watch.add(record_.pv[k], record_.co[k]);
      fit.largest = std::max(fit.largest, watch.largest());
      if (!watch.load_known()) continue;
      load.add(watch.load());
      seen_load.step = std::max(seen_load.step, std::abs(load.step()));
      if (++counted % minute == 0) loads.push_back(load.over_minutes());
    }
    if (loads.size() > 1) {
      seen_load.mean = numeric::mean(loads);
      seen_load.deviation = numeric::deviation(loads);
      fit.load = seen_load;
    }
    if (record_.has_sp()) fit.controller = seen_controller(twin);
  }

  plant::SeenController seen_controller(const LoopModel& twin) const {
    plant::SeenController out{.rms = 0.0, .resolution = gap::resolution_of(record_.co)};
    LoopModel tolerant = twin;
    tolerant.twin->controller = out;
    watch::ControllerWatch watch(tolerant);
    double squares = 0.0;
    std::size_t count = 0;
    const auto settled = static_cast<std::size_t>(5.0 * plant::answer_s(twin) / record_.period_s);
    for (std::size_t k = 0; k < record_.size(); ++k) {
      watch.add(record_.sp[k], record_.pv[k], record_.co[k]);
      if (k < settled || !std::isfinite(record_.pv[k])) continue;
      squares += watch.apart() * watch.apart();
      ++count;
    }
    out.rms = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : gap::kNone;
    return out;
  }

  // "SP", "CO": what the rest of the last third follows; empty: nothing, or it can't be told.
  std::string what_it_follows(double left) const {
    const gap::CheckedRecord& checked = checked_;
    const std::vector<double>& pv = out_.gap->series.pv_after;
    std::vector<double> error(pv.size());
    for (std::size_t k = 0; k < pv.size(); ++k) error[k] = checked.pv[k] - pv[k];
    const double noise = out_.gap->floor.transmitter_rmse;
    const double left_rms = std::sqrt(std::max(0.0, left * left - noise * noise));
    static const std::vector<double> kUnknown;
    const gap::Independence found =
        gap::test_independence({.error = error,
                                .counts = checked.used,
                                .sp = checked.record.has_sp() ? checked.sp : kUnknown,
                                .co = checked.closed_loop ? kUnknown : checked.co,
                                .stretch = {checked.training_end, checked.pv.size()},
                                .answer_s = plant::answer_s(checked.model),
                                .period_s = checked.record.period_s,
                                .left_rms = left_rms,
                                .nothing_rms = kMatters * noise,
                                .matters_rms = kMatters * left_rms});
    if (found.follows_sp) return "SP";
    return found.follows_co ? "CO" : "";
  }

  // RMSE of the last third, PV units, beside a level by which the disturbance may have moved since.
  double left_beside_level() const {
    constexpr double kMoves = 2.0;  // standard deviations of the disturbance
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t k = fitted_.fitted; k < checked_.pv.size(); ++k) {
      if (!checked_.used[k]) continue;
      sum += checked_.pv[k] - fit_.pv[k];
      count += 1.0;
    }
    const double rmse = out_.gap->after.holdout_rmse;
    if (count == 0.0) return rmse;
    const double most = kMoves * out_.gap->floor.load_rmse;
    const double mean = sum / count;
    const double level = std::clamp(mean, -most, most);
    return std::sqrt(std::max(0.0, rmse * rmse - level * (2.0 * mean - level)));
  }

  void judge(const estimator::Estimate& last) {
    finish(last);
    const double floor = out_.gap->floor.rmse();
    const double left = left_beside_level();
    // Where the model that it began with is right already, there is no gap to close: then what is
    // left counts.
    const std::string follows = what_it_follows(left);
    const bool little =
        left <= kRemarked * floor || (left <= kFewFloors * floor && follows.empty());
    if (std::isfinite(out_.closed) && out_.closed < kLeastClosed && !little) {
      refuse(Outcome::not_explained,
             text("Only %.0f %% of the error between model and record is explained; at least %.0f "
                  "%% is "
                  "required.",
                  100.0 * std::max(0.0, out_.closed), 100.0 * kLeastClosed));
      return;
    }
    if (last.verdict == estimator::Verdict::unexplained && left > kFewFloors * floor) {
      refuse(Outcome::not_explained,
             text("The remaining error of PV is %.1f times the noise floor, and no effect explains "
                  "it.",
                  left / floor));
      return;
    }
    out_.outcome = Outcome::commissioned;
    if (left > kRemarked * floor) {
      out_.notes.push_back(text(
          "the remaining error is %.2f times the noise floor%s: the twin may lack a small effect. "
          "report.html shows where. Record more moves of SP to find it",
          left / floor, follows.empty() ? "" : (", and it follows " + follows).c_str()));
    }
    out_.why =
        text("Remaining error of the twin: %.2f %% of the PV span, %.2f times the noise floor.",
             100.0 * left / out_.twin.transmitter.span(), left / floor);
  }

  void prove_on_others(double share) {
    for (std::size_t i = 1; i < request_.records.size(); ++i) {
      const numeric::LoopRecord& record = request_.records[i];
      const auto number = static_cast<int>(i + 1);
      const gap::CheckedRecord checked = gap::check(record, out_.twin);
      if (!checked.quality.usable) {
        refuse(Outcome::not_usable, text("Record %d: %s", number, checked.quality.refusal.c_str()));
        return;
      }
      LoopModel twin = out_.twin;
      twin.sample_time_s = record.period_s;
      const FittedRecord fitted = fitted_part(checked, twin);
      const estimator::Estimate found =
          estimator::estimate(fitted.observed, twin, {.without = kOfTheProcess}, parallel_);
      progress_(share * static_cast<double>(kMostRounds + number - 1));
      for (const estimator::Found& effect : found.effects) {
        const std::string why =
            why_not_healthy(effect.spec, effect.block, out_.twin, request_.healthy_limit_percent);
        if (why.empty()) continue;
        refuse(Outcome::not_healthy, text("Record %d: %s", number, why.c_str()));
        return;
      }
      if (found.verdict == estimator::Verdict::unexplained &&
          found.before.holdout > kFewFloors * found.floor) {
        refuse(Outcome::not_explained, text("Record %d does not agree with the twin of the first "
                                            "record, and no effect explains "
                                            "the difference.",
                                            number));
        return;
      }
      out_.notes.push_back(text("record %d: rmse %.4g PV units, noise floor %.4g", number,
                                found.before.holdout, found.floor));
    }
  }

  const Request& request_;
  const numeric::LoopRecord& record_;
  const numeric::ParallelFor& parallel_;
  const std::function<void(double)>& progress_;
  Commissioning out_;
  LoopModel model_;
  gap::CheckedRecord checked_;
  FittedRecord fitted_;
  ProcessFit fit_;
  std::vector<effects::EffectSpec> day_;
};

}  // namespace

const char* to_text(Outcome outcome) noexcept {
  return numeric::enum_name<Outcome::not_usable>(
      outcome,
      {"commissioned", "not_enough_movement", "not_healthy", "not_explained", "not_usable"});
}

double size_percent(const effects::EffectSpec& spec, double co_span) {
  double most = std::numeric_limits<double>::quiet_NaN();
  const auto form = spec.options.find("form");
  if (spec.name == "learned" && form != spec.options.end() && form->second == "hysteretic") {
    double lost = 0.0;  // on a long reversal: each play loses twice its threshold
    for (const auto& [threshold, weight] : spec.table) lost += 2.0 * threshold * std::abs(weight);
    return 100.0 * lost / co_span;
  }
  for (const char* name : {"s", "s_closing", "deadband", "width", "offset", "step"}) {
    const auto found = spec.parameters.find(name);
    if (found == spec.parameters.end()) continue;
    const double size = 100.0 * std::abs(found->second) / co_span;
    if (!(most >= size)) most = size;
  }
  return most;
}

Commissioning commission(const Request& request, const numeric::ParallelFor& parallel,
                         const std::function<void(double)>& progress) {
  return Commissioner(request, parallel, progress).run();
}

}  // namespace loopwarden::twin
