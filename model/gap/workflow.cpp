// SPDX-License-Identifier: Apache-2.0
#include "model/gap/workflow.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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
#include "model/numeric/text.hpp"

namespace loopwarden::gap {
namespace {

using numeric::text;

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

std::string samples_off(int late) {
  return text("%d sample%s too %s", std::abs(late), std::abs(late) > 1 ? "s" : "",
              late > 0 ? "late" : "early");
}

// The record as it is looked at: CO moved back where the logger wrote it too late.
struct Taken {
  Record given;
  CheckedRecord checked;
  int late = 0;  // samples
};

Taken take(const Record& as_logged, const plant::LoopModel& model) {
  Taken taken{as_logged, check(as_logged, model)};
  if (taken.checked.quality.usable) taken.late = logger_shift(as_logged, model);
  if (taken.late == 0) return taken;
  taken.given = with_co_moved_back(as_logged, taken.late);
  taken.checked = check(taken.given, model);
  taken.checked.quality.notes.push_back(
      {"logger", "CO is logged " + samples_off(taken.late) +
                     " against PV: it is taken back by as much, and is no dead time of the loop."});
  return taken;
}

// The stages from the fit on; each takes what those before it have found.
class Workflow {
 public:
  Workflow(const Taken& taken, const plant::LoopModel& model, const Options& options)
      : taken_(taken),
        record_(taken.checked),
        model_(model),
        options_(options),
        reading_(describe_reading(record_.reading, model)),
        model_fit_(record_, options.search, options.largest_load) {
    std::erase_if(reading_, [&](const FoundEffect& e) { return left_out(e.spec.name); });
    if (!record_.closed_loop && !left_out("controller_mismatch")) {
      controller_ = compare_controller(record_.record, record_.model);
    }
  }

  Result run(Result result, const ParallelFor& parallel,
             const std::function<void(double)>& progress) {
    result_ = std::move(result);
    search(parallel, progress);
    prove();
    if (result_.outcome == Outcome::unexplained && !record_.closed_loop && !left_out("learned")) {
      learn_effect();
    }
    describe_rest();
    name_effects();
    if (result_.outcome != Outcome::no_gap) {
      find_where();
      describe_remainder();
    }
    say();
    result_.series = std::move(series_);
    return std::move(result_);
  }

 private:
  bool left_out(std::string_view name) const {
    const std::vector<std::string>& names = options_.search.without;
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  const Fit& fit() const noexcept { return search_.chosen.fit; }
  const FreeRun& free_run() const noexcept { return model_fit_.run; }
  std::vector<double> pv_of(const plant::LoopModel& model, const Fit& fit) const {
    return simulated(model, fit, record_, free_run());
  }
  Misfit misfit(const std::vector<double>& pv, double floor) const {
    return misfit_of(record_.pv, pv, record_.used, floor);
  }

  void search(const ParallelFor& parallel, const std::function<void(double)>& progress) {
    const Scale scale{record_.quality.noise_rms, model_fit_.least_rms};
    search_ = search_effects(model_fit_.fitter, model_fit_.searched, scale, options_.search,
                             parallel, progress);
    result_.adjusted = free_run().corrected({}, search_.base.point, search_.base.solved);
    result_.adjusted.transmitter = model_.transmitter;
    result_.adjusted.controller = model_.controller;
    left_ = examine(model_fit_.fitter, search_, record_.co, record_.quality.noise_rms,
                    record_.record.period_s);
    decision_ = decide(competition_of(search_), left_, controller_, scale);
    decision_.by_reading = !reading_.empty();
  }

  plant::LoopModel corrected(const Decision& decision, const Fit& fit) const {
    return corrected_model(model_, decision, reading_, controller_, fit, free_run());
  }

  void prove() {
    series_ = series_of(taken_.given, record_, controller_);
    series_.pv_before = pv_of(record_.model, search_.base);
    result_.before = misfit(series_.pv_before, left_.floor_rmse);
    series_.pv_after = pv_of(corrected(decision_, fit()), fit());
    result_.after = misfit(series_.pv_after, left_.floor_rmse);
    if (!decision_.named.empty()) {
      trial_ = try_on_holdout(model_fit_, search_, record_, left_, result_.before, result_.after);
      proof_ = judge(trial_);
    }
    result_.outcome = outcome_of(decision_, proof_);
    const bool refuted = proof_ == Proof::refuted;
    kept_ = decision_;
    if (refuted) kept_.named.clear();
    if (result_.outcome != Outcome::missing_effect) kept_.other_settings = false;
    result_.corrected = corrected(kept_, refuted ? search_.base : fit());
    if (!refuted) return;
    series_.pv_after = kept_.other_settings || kept_.by_reading
                           ? pv_of(result_.corrected, search_.base)
                           : series_.pv_before;
    result_.after = misfit(series_.pv_after, left_.floor_rmse);
  }

  // What no name explains, learned and proved on the holdout. What the names left was taken for a load in part; here
  // noise alone is the floor.
  void learn_effect() {
    const Fit& base = search_.base;
    const double floor = kNoiseFloor * record_.quality.noise_rms;
    const std::optional<Learned> learned = learn(free_run(), base, record_);
    if (!learned) return;
    plant::LoopModel model = free_run().corrected(base.terms, base.point, base.solved);
    (learned->block == plant::Block::valve ? model.valve_effects : model.process_effects)
        .push_back(learned->spec);
    std::vector<double> pv = pv_of(model, base);
    const Misfit after = misfit(pv, floor);
    const double closed = gap_closed(result_.before.holdout_rmse, after.holdout_rmse, floor);
    const bool holds = std::isfinite(closed)
                           ? closed >= kPartlyClosed
                           : after.holdout_rmse <= kWorstHoldout * result_.before.holdout_rmse;
    if (!holds) return;
    model.transmitter = model_.transmitter;
    model.controller = result_.corrected.controller;
    result_.corrected = std::move(model);
    result_.after = after;
    result_.outcome = Outcome::missing_effect;
    series_.pv_after = std::move(pv);
    learned_.emplace();
    learned_->spec = learned->spec;
    learned_->block = learned->block;
    learned_->confidence = std::min(kMostLearned, std::isfinite(closed) ? closed : kPartlyClosed);
    learned_->evidence = text(
        "no name fits; form %s, chosen by what it leaves on stretches that were left out, where it "
        "closes %.0f %% of the gap",
        learned->spec.options.at("form").c_str(), 100.0 * learned->closed);
  }

  void describe_rest() {
    result_.closed_loop = record_.closed_loop;
    result_.holdout_from_s = record_.record.time_s(record_.training_end);
    result_.noise_floor_rmse =
        learned_ ? kNoiseFloor * record_.quality.noise_rms : left_.floor_rmse;
    result_.load_intensity = learned_ ? 0.0 : left_.load_intensity;
    result_.rest = {.is_noise = left_.adequate,
                    .noise_ratio = left_.noise_ratio,
                    .kurtosis = left_.tail,
                    .answer_to_co = left_.answer,
                    .closed = left_.closed};
    if (controller_.compared) {
      result_.controller_before_rmse = controller_.before_rmse;
      result_.controller_after_rmse = controller_.after_rmse;
    }
    if (!controller_.anti_windup.empty()) {
      result_.check.notes.push_back(
          {"anti-windup",
           "near its limits CO behaves as with anti_windup: " + controller_.anti_windup});
    }
    if (proof_ == Proof::refuted && decision_.believable && !learned_) {
      result_.check.notes.push_back(
          {"holdout", "the best explanation of the first two thirds fails on the last third",
           result_.holdout_from_s, record_.record.time_s(record_.record.size() - 1)});
    }
  }

  void name_effects() {
    std::vector<FoundEffect>& effects = result_.effects;
    if (kept_.other_settings) {
      effects.push_back(describe_controller(controller_, model_.controller.pid.gains));
    }
    effects.insert(effects.end(), reading_.begin(), reading_.end());
    for (FoundEffect& effect : describe_effects(kept_, proof_, search_, model_fit_)) {
      effects.push_back(std::move(effect));
    }
    if (learned_) {
      effects.push_back(*learned_);
    } else if (result_.outcome == Outcome::missing_effect) {
      result_.steps = steps_of(search_, record_, free_run(), left_.floor_rmse);
    }
    result_.candidates = describe_tried(search_, model_fit_, result_.outcome);
  }

  void find_where() {
    std::vector<LocatedEffect> effects;
    if (!kept_.named.empty()) effects = energies_of(fit(), model_fit_.fitter, record_);
    const bool controller_differs = controller_.mismatch || controller_.unexplained;
    result_.located =
        locate({.model = model_,
                .time_s = series_.time_s,
                .pv = series_.pv,
                .pv_before = series_.pv_before,
                .co = series_.co,
                .rmse = result_.before.rmse,
                .noise_floor_rmse = result_.noise_floor_rmse,
                .controller_rmse = controller_differs ? controller_.before_rmse : 0.0,
                .effects = effects,
                .likely = learned_                     ? learned_->block
                          : result_.candidates.empty() ? plant::Block::process
                                                       : result_.candidates.front().block});
  }

  void describe_remainder() {
    if (!(result_.after.holdout_rmse > result_.noise_floor_rmse)) return;
    const double closed = gap_closed(result_.before.holdout_rmse, result_.after.holdout_rmse,
                                     result_.noise_floor_rmse);
    result_.remainder = {
        .rmse = result_.after.holdout_rmse,
        .share = 1.0 - closed,
        .looks_like = looks_like({.model = model_,
                                  .pv = series_.pv,
                                  .pv_after = series_.pv_after,
                                  .co = series_.co,
                                  .is_noise = left_.adequate && !kept_.named.empty()})};
  }

  void say() {
    result_.sentence = sentence_of({.outcome = result_.outcome,
                                    .effects = result_.effects,
                                    .before = result_.before,
                                    .after = result_.after,
                                    .remainder = result_.remainder,
                                    .best = taken_back_names(decision_, proof_),
                                    .best_closed = trial_.closed,
                                    .closed_loop = result_.closed_loop,
                                    .with_load = result_.load_intensity > 0.0});
    if (taken_.late == 0) return;
    result_.sentence +=
        " CO was logged " + samples_off(taken_.late) + "; that is no effect of the loop.";
  }

  const Taken& taken_;
  const CheckedRecord& record_;
  const plant::LoopModel& model_;
  const Options& options_;
  std::vector<FoundEffect> reading_;
  const ModelFit model_fit_;
  ControllerFinding controller_;
  SearchResult search_;
  Residuals left_;
  Decision decision_;
  Decision kept_;  // what of it the holdout left
  Trial trial_;
  Proof proof_ = Proof::holds;
  std::optional<FoundEffect> learned_;
  Series series_;
  Result result_;
};

}  // namespace

Result find_gap(const Record& as_logged, const plant::LoopModel& model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress) {
  const Taken taken = take(as_logged, model);
  Result result;
  result.model = model;
  result.corrected = model;
  result.adjusted = model;
  result.check = taken.checked.quality;
  if (!result.check.usable) return result;
  return Workflow(taken, model, options).run(std::move(result), parallel, progress);
}

}  // namespace loopwarden::gap
