// SPDX-License-Identifier: Apache-2.0
#include "model/gap/workflow.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "model/gap/check.hpp"
#include "model/gap/confidence.hpp"
#include "model/gap/constants.hpp"
#include "model/gap/controller.hpp"
#include "model/gap/decide.hpp"
#include "model/gap/fit_model.hpp"
#include "model/gap/learn.hpp"
#include "model/gap/locate.hpp"
#include "model/gap/logger.hpp"
#include "model/gap/model_run.hpp"
#include "model/gap/prove.hpp"
#include "model/gap/say.hpp"
#include "model/gap/text.hpp"

namespace loopwarden::gap {
namespace {

// PV as a corrected model gives it, from the fit's own place of the stem at the start.
std::vector<double> simulated(plant::LoopModel model, const Fit& fit, const CheckedRecord& record,
                              const FreeRun& run) {
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  return record.closed_loop ? closed_loop(model, record.sp, record.pv.front())
                            : free_run(model, record.co, record.pv, record.measured,
                                       run.start_offset(fit.terms, fit.point));
}

// The model with what was found, its transmitter's noise and rounding as given.
plant::LoopModel corrected_model(const plant::LoopModel& given, const Decision& decision,
                                 const std::vector<FoundEffect>& reading,
                                 const ControllerFinding& controller, const Fit& fit,
                                 const FreeRun& run) {
  plant::LoopModel out = given;
  if (!fit.terms.empty() || decision.by_reading) {
    out = run.corrected(fit.terms, fit.point, fit.solved);
    out.transmitter = given.transmitter;
    out.controller = given.controller;
  }
  for (const FoundEffect& effect : reading) out.transmitter_effects.push_back(effect.spec);
  if (decision.other_settings) {
    out.controller.pid.gains.kp = controller.kp;
    out.controller.pid.gains.ki = controller.ki;
  }
  return out;
}

// One effect after another as the search took them in, or out again.
std::vector<Step> steps_of(const SearchResult& search, const CheckedRecord& record,
                           const FreeRun& run, double floor) {
  std::vector<Step> steps;
  std::vector<std::string> before;
  for (const std::vector<std::string>& names : search.path) {
    const auto hypothesis =
        std::find_if(search.tried.begin(), search.tried.end(), [&](const Hypothesis& h) {
          return h.fit.terms.size() == names.size() &&
                 std::all_of(names.begin(), names.end(),
                             [&](const std::string& name) { return contains(h.fit, name); });
        });
    const Fit& fit =
        names.size() == search.chosen.fit.terms.size() || hypothesis == search.tried.end()
            ? search.chosen.fit
            : hypothesis->fit;
    const plant::LoopModel model = run.corrected(fit.terms, fit.point, fit.solved);
    const Misfit misfit =
        misfit_of(record.pv, simulated(model, fit, record, run), record.used, floor);
    const auto add_new = [&](const std::vector<std::string>& of,
                             const std::vector<std::string>& against, Step::Change change) {
      for (const std::string& name : of) {
        if (std::find(against.begin(), against.end(), name) == against.end()) {
          steps.push_back({name, change, misfit.training_rmse, misfit.holdout_rmse});
        }
      }
    };
    add_new(before, names, Step::Change::taken_out);
    add_new(names, before, Step::Change::added);
    before = names;
  }
  return steps;
}

// What each effect alone accounts for: how much worse the whole is without it.
std::vector<LocatedEffect> energies_of(const Fit& fit, const Fitter& fitter,
                                       const CheckedRecord& record) {
  if (fit.terms.size() == 1) return {{fit.terms[0]->block, 1.0}};
  std::vector<LocatedEffect> out;
  const std::vector<double> whole = fitter.simulate(fit);
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    const std::vector<double> without = fitter.simulate(fitter.fit_without(fit, i, 60));
    const double apart = rms_between(whole, without, record.used, {0, record.training_end});
    out.push_back({fit.terms[i]->block, apart * apart});
  }
  return out;
}

// What was the best explanation, and did not hold.
std::vector<std::string> taken_back_names(const Decision& decision, Proof proof) {
  std::vector<std::string> names;
  if (proof != Proof::refuted) return names;
  for (const NamedEffect& named : decision.named) names.push_back(named.name);
  return names;
}

// What no name explains, learned and proved on the holdout: into `result` and `series`. What the names left was taken for
// a load in part; here noise alone is the floor.
std::optional<FoundEffect> learn_effect(const ModelFit& model_fit, const Fit& base,
                                        const CheckedRecord& record, Result& result,
                                        Series& series) {
  const double floor = kNoiseFloor * record.quality.noise_rms;
  const std::optional<Learned> learned = learn(model_fit.run, base, record);
  if (!learned) return std::nullopt;
  plant::LoopModel model = model_fit.run.corrected(base.terms, base.point, base.solved);
  (learned->block == plant::Block::valve ? model.valve_effects : model.process_effects)
      .push_back(learned->spec);
  std::vector<double> pv = simulated(model, base, record, model_fit.run);
  const Misfit after = misfit_of(record.pv, pv, record.used, floor);
  const double closed = gap_closed(result.before.holdout_rmse, after.holdout_rmse, floor);
  const bool holds = std::isfinite(closed)
                         ? closed >= kPartlyClosed
                         : after.holdout_rmse <= kWorstHoldout * result.before.holdout_rmse;
  if (!holds) return std::nullopt;
  model.transmitter = result.model.transmitter;
  model.controller = result.corrected.controller;
  result.corrected = std::move(model);
  result.after = after;
  series.pv_after = std::move(pv);
  FoundEffect effect;
  effect.spec = learned->spec;
  effect.block = learned->block;
  effect.confidence = std::min(kMostLearned, std::isfinite(closed) ? closed : kPartlyClosed);
  effect.evidence = text(
      "no name fits; form %s, chosen by what it leaves on stretches that were left out, where it "
      "closes %.0f %% of "
      "the gap",
      learned->spec.options.at("form").c_str(), 100.0 * learned->closed);
  return effect;
}

Series series_of(const Record& given, const CheckedRecord& record,
                 const ControllerFinding& controller) {
  Series s;
  for (std::size_t k = 0; k < record.record.size(); ++k) {
    s.time_s.push_back(record.record.time_s(k));
  }
  s.pv = record.record.pv;
  if (given.has_sp()) s.sp = given.sp;
  s.co = given.has_co() ? given.co : record.co;
  if (Record::has_value(given.stem)) s.stem = given.stem;
  s.co_before = controller.before;
  s.co_after = controller.after;
  return s;
}

}  // namespace

Result find_gap(const Record& as_logged, const plant::LoopModel& model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress) {
  CheckedRecord record = check(as_logged, model);
  int late = 0;
  Record moved;
  if (record.quality.usable) late = logger_shift(as_logged, model);
  if (late != 0) {
    moved = with_co_moved_back(as_logged, late);
    record = check(moved, model);
    record.quality.notes.push_back(
        {"logger",
         text("CO is logged %d sample%s too %s against PV: it is taken back by as much, "
              "and is no dead time of the loop.",
              std::abs(late), std::abs(late) > 1 ? "s" : "", late > 0 ? "late" : "early")});
  }
  const Record& given = late != 0 ? moved : as_logged;
  Result result;
  result.model = model;
  result.corrected = model;
  result.adjusted = model;
  result.check = record.quality;
  if (!record.quality.usable) return result;

  const auto left_out = [&](const std::string& name) {
    const std::vector<std::string>& names = options.search.without;
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::vector<FoundEffect> reading = describe_reading(record.reading, model);
  std::erase_if(reading, [&](const FoundEffect& effect) { return left_out(effect.spec.name); });
  const ControllerFinding controller = record.closed_loop || left_out("controller_mismatch")
                                           ? ControllerFinding{}
                                           : compare_controller(record.record, record.model);
  const ModelFit model_fit(record, options.search, options.largest_load);
  const Scale scale{record.quality.noise_rms, model_fit.least_rms};
  const SearchResult search = search_effects(model_fit.fitter, model_fit.searched, scale,
                                             options.search, parallel, progress);
  result.adjusted = model_fit.run.corrected({}, search.base.point, search.base.solved);
  result.adjusted.transmitter = model.transmitter;
  result.adjusted.controller = model.controller;
  const Residuals left = examine(model_fit.fitter, search, record.co, record.quality.noise_rms,
                                 record.record.period_s);
  Decision decision = decide(competition_of(search), left, controller, scale);
  decision.by_reading = !reading.empty();

  const Fit& fit = search.chosen.fit;
  const auto misfit = [&](const std::vector<double>& pv) {
    return misfit_of(record.pv, pv, record.used, left.floor_rmse);
  };
  Series series = series_of(given, record, controller);
  series.pv_before = simulated(record.model, search.base, record, model_fit.run);
  result.before = misfit(series.pv_before);
  const plant::LoopModel corrected =
      corrected_model(model, decision, reading, controller, fit, model_fit.run);
  series.pv_after = simulated(corrected, fit, record, model_fit.run);
  result.after = misfit(series.pv_after);
  Decision kept = decision;
  Trial trial;
  Proof proof = Proof::holds;
  if (!decision.named.empty()) {
    trial = try_on_holdout(model_fit, search, record, left, result.before, result.after);
    proof = judge(trial);
  }
  result.verdict = verdict_of(decision, proof);
  if (proof == Proof::refuted) kept.named.clear();
  if (result.verdict != Verdict::missing_effect) kept.other_settings = false;
  const Fit& kept_fit = proof == Proof::refuted ? search.base : fit;
  result.corrected = corrected_model(model, kept, reading, controller, kept_fit, model_fit.run);
  if (proof == Proof::refuted) {
    series.pv_after = kept.other_settings || kept.by_reading
                          ? simulated(result.corrected, search.base, record, model_fit.run)
                          : series.pv_before;
    result.after = misfit(series.pv_after);
  }

  std::optional<FoundEffect> learned;
  if (result.verdict == Verdict::unexplained && !record.closed_loop && !left_out("learned")) {
    learned = learn_effect(model_fit, search.base, record, result, series);
    if (learned) result.verdict = Verdict::missing_effect;
  }

  result.closed_loop = record.closed_loop;
  result.holdout_from_s = record.record.time_s(record.training_end);
  result.noise_floor_rmse = learned ? kNoiseFloor * record.quality.noise_rms : left.floor_rmse;
  result.load_intensity = learned ? 0.0 : left.load_intensity;
  result.rest = {.is_noise = left.adequate,
                 .noise_ratio = left.noise_ratio,
                 .kurtosis = left.tail,
                 .answer_to_co = left.answer,
                 .closed = left.closed};
  if (controller.compared) {
    result.controller_before_rmse = controller.before_rmse;
    result.controller_after_rmse = controller.after_rmse;
    if (!controller.anti_windup.empty()) {
      result.check.notes.push_back(
          {"anti-windup",
           "near its limits CO behaves as with anti_windup: " + controller.anti_windup});
    }
  }
  if (proof == Proof::refuted && decision.believable && !learned) {
    result.check.notes.push_back(
        {"holdout", "the best explanation of the first two thirds fails on the last third",
         result.holdout_from_s, record.record.time_s(record.record.size() - 1)});
  }
  if (kept.other_settings) {
    result.effects.push_back(describe_controller(controller, model.controller.pid.gains));
  }
  result.effects.insert(result.effects.end(), reading.begin(), reading.end());
  for (FoundEffect& effect : describe_effects(kept, proof, search, model_fit)) {
    result.effects.push_back(std::move(effect));
  }
  if (learned) {
    result.effects.push_back(*learned);
  } else if (result.verdict == Verdict::missing_effect) {
    result.steps = steps_of(search, record, model_fit.run, left.floor_rmse);
  }
  result.candidates = describe_tried(search, model_fit, result.verdict);
  if (result.verdict != Verdict::no_gap) {
    std::vector<LocatedEffect> effects;
    if (!kept.named.empty()) {
      effects = energies_of(fit, model_fit.fitter, record);
    }
    result.located =
        locate({.model = model,
                .time_s = series.time_s,
                .pv = series.pv,
                .pv_before = series.pv_before,
                .co = series.co,
                .rmse = result.before.rmse,
                .noise_floor_rmse = result.noise_floor_rmse,
                .controller_rmse =
                    controller.mismatch || controller.unexplained ? controller.before_rmse : 0.0,
                .effects = effects,
                .likely = learned                     ? learned->block
                          : result.candidates.empty() ? plant::Block::process
                                                      : result.candidates.front().block});
  }
  if (result.verdict != Verdict::no_gap && result.after.holdout_rmse > result.noise_floor_rmse) {
    const double closed =
        gap_closed(result.before.holdout_rmse, result.after.holdout_rmse, result.noise_floor_rmse);
    result.remainder = {
        .rmse = result.after.holdout_rmse,
        .share = 1.0 - closed,
        .looks_like = looks_like({.model = model,
                                  .pv = series.pv,
                                  .pv_after = series.pv_after,
                                  .co = series.co,
                                  .is_noise = left.adequate && !kept.named.empty()})};
  }
  result.sentence = sentence_of({.verdict = result.verdict,
                                 .effects = result.effects,
                                 .before = result.before,
                                 .after = result.after,
                                 .remainder = result.remainder,
                                 .best = taken_back_names(decision, proof),
                                 .best_closed = trial.closed,
                                 .closed_loop = result.closed_loop,
                                 .with_load = result.load_intensity > 0.0});
  if (late != 0) {
    result.sentence +=
        text(" CO was logged %d sample%s too %s; that is no effect of the loop.", std::abs(late),
             std::abs(late) > 1 ? "s" : "", late > 0 ? "late" : "early");
  }
  result.series = std::move(series);
  return result;
}

}  // namespace loopwarden::gap
