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
#include "model/gap/independence.hpp"
#include "model/gap/learn.hpp"
#include "model/gap/level.hpp"
#include "model/gap/locate.hpp"
#include "model/gap/logger.hpp"
#include "model/gap/model_run.hpp"
#include "model/gap/prove.hpp"
#include "model/gap/say.hpp"
#include "model/numeric/statistics.hpp"
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

void add_bias(std::vector<effects::EffectSpec>& transmitter, double bias) {
  const auto own = std::find_if(transmitter.begin(), transmitter.end(),
                                [](const effects::EffectSpec& s) { return s.name == kLevelName; });
  if (own == transmitter.end()) {
    transmitter.insert(transmitter.begin(), effects::EffectSpec{kLevelName, {{"bias", bias}}});
  } else {
    own->parameters["bias"] += bias;
  }
}

// The model with what was found, its transmitter's noise and rounding as given.
plant::LoopModel corrected_model(const plant::LoopModel& given, const Decision& decision,
                                 const std::vector<FoundEffect>& reading,
                                 const ControllerFinding& controller, const Fit& fit,
                                 const FreeRun& run) {
  plant::LoopModel out = given;
  if (!fit.terms.empty() || decision.by_reading || decision.level) {
    out = run.corrected(fit.terms, fit.point, fit.solved);
    out.transmitter = given.transmitter;
    out.controller = given.controller;
  }
  if (decision.level) {
    out.process.level = given.process.level;
    add_bias(out.transmitter_effects, run.fitted_level(fit.solved));
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

// What each effect alone accounts for: how much worse the whole is without it. `without_level`:
// null if no level is named.
std::vector<LocatedEffect> energies_of(const Fit& fit, const Fit* without_level,
                                       const Fitter& fitter, const CheckedRecord& record) {
  std::vector<LocatedEffect> out;
  const std::vector<double> whole = fitter.simulate(fit);
  if (without_level != nullptr) {
    const std::vector<double> pv = fitter.simulate(*without_level);
    const double apart = rms_between(whole, pv, record.used, {0, record.training_end});
    out.push_back({effects::Block::transmitter, apart * apart});
  }
  if (fit.terms.size() + out.size() == 1) return {{fit.terms[0]->block, 1.0}};
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    const std::vector<double> without = fitter.simulate(fitter.fit_without(fit, i, 60));
    const double apart = rms_between(whole, without, record.used, {0, record.training_end});
    out.push_back({fit.terms[i]->block, apart * apart});
  }
  return out;
}

// What the model's own load adds to a free run, PV units.
double stated_load_rms(const plant::LoopModel& model) {
  double square = 0.0;
  for (const effects::EffectSpec& spec : model.disturbances) {
    if (spec.name != "random_load") continue;
    const double intensity = spec.parameters.at("intensity");
    square += 0.5 * intensity * intensity * spec.parameters.at("time_constant");
  }
  return std::sqrt(square);
}

// What was the best explanation, and did not hold.
std::vector<std::string> taken_back_names(const Decision& decision, Proof proof) {
  std::vector<std::string> names;
  if (proof != Proof::refuted) return names;
  for (const NamedEffect& named : decision.named) names.push_back(named.name);
  if (decision.level) names.push_back(decision.level->name);
  return names;
}

Series series_of(const LoopRecord& given, const CheckedRecord& record,
                 const ControllerFinding& controller) {
  Series s;
  for (std::size_t k = 0; k < record.record.size(); ++k) {
    s.time_s.push_back(record.record.seconds_at(k));
  }
  s.pv = record.record.pv;
  if (given.has_sp()) s.sp = given.sp;
  s.co = given.has_co() ? given.co : record.co;
  if (LoopRecord::has_value(given.stem)) s.stem = given.stem;
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
  LoopRecord given;
  CheckedRecord checked;
  int late = 0;  // samples
};

Taken take(const LoopRecord& as_logged, const plant::LoopModel& model) {
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
        model_fit_(record_, options.search, options.largest_load),
        scale_{record_.quality.noise_rms, model_fit_.least_rms} {
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
    if (result_.outcome == Outcome::unexplained && learned_law()) learn_effect(*learned_law());
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
    const bool level_free =
        free_run().fits_level() && !record_.closed_loop && !options_.search.level_of_record;
    const SearchResult alone = model_alone();
    std::optional<LevelFinding> shown;
    if (level_free) {
      shown = find_level(model_fit_.fitter, alone, scale_);
      model_fit_.fitter.hold_level(!shown->shown);
    }
    search_ = search_effects(model_fit_.fitter, model_fit_.searched, scale_, options_.search,
                             parallel, progress);
    choose_alike();
    if (shown && shown->shown) settle_level(*shown, alone.base_rmse, parallel, progress);
    result_.adjusted = free_run().corrected({}, search_.base.point, search_.base.solved);
    result_.adjusted.transmitter = model_.transmitter;
    result_.adjusted.controller = model_.controller;
    left_ = left_by(search_.chosen, only_level() ? level_->base_rmse : search_.base_rmse);
    decision_ = decide(competition_of(search_), left_, controller_, scale_);
    if (level_) {
      decision_.level = {
          kLevelName, level_->lead_nats, confidence(level_->lead_nats, left_.adequate), {}};
    }
    decision_.by_reading = !reading_.empty();
  }

  // Of fits of the same names that their own data can't tell apart the middle one on the data that
  // none was fitted to, of two in the middle the nearer: the best of many there would be chosen by
  // what is to prove it; of two it still is.
  void choose_alike() {
    std::vector<std::pair<double, std::size_t>> there;
    for (std::size_t i = 0; i < search_.alike.size(); ++i) {
      const Fit& fit = search_.alike[i].fit;
      const plant::LoopModel model = free_run().corrected(fit.terms, fit.point, fit.solved);
      there.emplace_back(holdout_rmse(pv_of(model, fit)), i);
    }
    if (there.empty()) return;
    std::sort(there.begin(), there.end());
    search_.chosen = search_.alike[there[(there.size() - 1) / 2].second];
  }

  // Returns the model without effects, with a free level if it states none.
  SearchResult model_alone() const {
    SearchResult out;
    out.base = model_fit_.fitter.fit_model();
    out.base_rmse = model_fit_.fitter.training_rmse(out.base);
    out.chosen.fit = out.base;
    out.chosen.training_rmse = out.base_rmse;
    return out;
  }

  // The model without effects shows a level that it does not state. The level is named if the
  // record shows it in addition to the effects. It is also named if it explains most of the error
  // without them and the fit is better with it: an effect then imitates a part of it. Otherwise
  // the search starts again at the model's own level, because it can find other effects there.
  // `alone_rmse`: error of the model with the level, PV units.
  void settle_level(const LevelFinding& alone, double alone_rmse, const ParallelFor& parallel,
                    const std::function<void(double)>& progress) {
    constexpr double kMostOfError = 0.9;  // of the mean squared error
    LevelFinding found = find_level(model_fit_.fitter, search_, scale_);
    const bool explains_most =
        alone_rmse * alone_rmse <= (1.0 - kMostOfError) * alone.base_rmse * alone.base_rmse;
    if (found.shown || (explains_most && found.lead_nats > 0.0)) {
      found.lead_nats = std::max(found.lead_nats, alone.lead_nats);
      level_ = found;
      return;
    }
    model_fit_.fitter.hold_level(true);
    search_ = search_effects(model_fit_.fitter, model_fit_.searched, scale_, options_.search,
                             parallel, progress);
    choose_alike();
  }
  bool only_level() const noexcept { return level_ && fit().terms.empty(); }

  // `base_rmse`: of the model alone, PV units, first two thirds.
  Residuals left_by(const Hypothesis& hypothesis, double base_rmse) const {
    return examine(model_fit_.fitter, hypothesis, base_rmse, record_.co, record_.quality.noise_rms,
                   record_.record.period_s);
  }

  // PV of the model as given. A level that it does not state is the record's, unless it is named as
  // missing: the level of a fit belongs to the gain of that fit.
  std::vector<double> given_pv(bool level_named) const {
    const bool free = !level_named && free_run().fitted_level(search_.base.solved) != 0.0;
    plant::LoopModel model = record_.model;
    model.transmitter.noise = 0.0;
    model.transmitter.resolution = 0.0;
    if (record_.closed_loop) return pv_of(model, search_.base);
    return gap::free_run(model, record_.co, record_.pv, record_.measured, 0.0,
                         free ? Level::of_record : Level::of_model);
  }

  plant::LoopModel corrected(const Decision& decision, const Fit& fit) const {
    return corrected_model(model_, decision, reading_, controller_, fit, free_run());
  }

  void prove() {
    series_ = series_of(taken_.given, record_, controller_);
    series_.pv_before = given_pv(decision_.level.has_value());
    series_.pv_after = pv_of(corrected(decision_, fit()), fit());
    weigh_rest(decision_.names_any() ? series_.pv_after : model_pv(), left_.adequate);
    take_misfits();
    if (!decision_.named.empty() && ousted()) {
      proof_ = Proof::refuted;
      ousted_ = true;
    } else if (decision_.names_any()) {
      // Effects are judged against the model with the record's level, the level against the model
      // without.
      const Misfit before =
          only_level() ? result_.before : misfit(given_pv(false), result_.floor.rmse());
      trial_ = try_on_holdout(model_fit_, only_level() ? level_->base : search_.base, fit(),
                              record_, left_, result_.floor, before, result_.after);
      proof_ = judge(trial_);
      if (proof_ == Proof::refuted && holds_until_holdout()) {
        proof_ = Proof::partly;
        until_s_ = record_.record.seconds_at(record_.training_end);
      }
    }
    kept_ = decision_;
    const bool refuted = proof_ == Proof::refuted;
    if (refuted) take_names_back();
    result_.outcome = outcome_of(kept_, kept_.level && refuted ? Proof::holds : proof_);
    if (result_.outcome != Outcome::missing_effect) kept_.other_settings = false;
    result_.corrected = corrected(kept_, refuted ? search_.base : fit());
    if (refuted) show_without_names();
    if (result_.outcome == Outcome::no_gap) show_adjusted();
  }

  void show_without_names() {
    series_.pv_before = given_pv(kept_.level.has_value());
    series_.pv_after = kept_.by_reading || kept_.level ? pv_of(result_.corrected, search_.base)
                                                       : series_.pv_before;
    take_misfits();
  }

  // If nothing is missing: the model with its process moved within the stated uncertainty, if that
  // leaves less over the whole record, the start included.
  void show_adjusted() {
    const plant::ProcessParameters& given = model_.process;
    const plant::ProcessParameters& moved = result_.adjusted.process;
    std::vector<double> pv = adjusted_pv();
    if (!(misfit(pv, result_.floor.rmse()).rmse < result_.before.rmse)) return;
    series_.pv_after = std::move(pv);
    take_misfits();
    result_.check.notes.push_back(
        {"process",
         text("within its uncertainty the process fits best with gain %.4g (model: %.4g)",
              moved.gain, given.gain) +
             (given.integrating() ? std::string()
                                  : text(", time constant %.4g s (%.4g s)", moved.time_constant_s,
                                         given.time_constant_s)) +
             text(", dead time %.4g s (%.4g s): that leaves %.3g rms", moved.dead_time_s,
                  given.dead_time_s, result_.after.rmse)});
  }

  // What wanders on can't be carried into the holdout: it must not make that worse, and is proved
  // on blocks left out.
  bool holds_until_holdout() const {
    const Terms& terms = fit().terms;
    const bool wanders = std::any_of(terms.begin(), terms.end(),
                                     [](const effects::Candidate* t) { return t->wanders_on; });
    if (!wanders || !left_.adequate || left_.closed < kClosed ||
        trial_.choice_rmse > trial_.model_rmse) {
      return false;
    }
    const Lead lead = lead_on_blocks_left_out(model_fit_.fitter, fit(), search_.base);
    return lead.nats > kFurtherGain && lead.ahead >= kOustsOn;
  }

  // Then the model alone must account for the record, and where it does, nothing is missing; unless
  // the names were far ahead of it where they were fitted.
  void take_names_back() {
    const Hypothesis alone{search_.base, 0.0, search_.base_rmse};
    const Residuals left = left_by(alone, search_.base_rmse);
    const double nats = only_level() ? level_->lead_nats : search_.chosen.score;
    weigh_rest(model_pv(), left.adequate);
    kept_.named.clear();
    kept_.unexplained = controller_.unexplained || ousted_ || independence_.follows() ||
                        nats > kFurtherGain || !left.adequate;
    if (kept_.unexplained || only_level()) kept_.level.reset();
    if (!kept_.unexplained) left_ = left;
  }

  SampleRange holdout() const { return {record_.training_end, record_.pv.size()}; }
  double holdout_rmse(const std::vector<double>& pv) const {
    return rms_between(record_.pv, pv, record_.used, holdout());
  }

  // The model without effects, its process moved within its uncertainty.
  std::vector<double> adjusted_pv() const {
    plant::LoopModel model = result_.adjusted;
    for (const FoundEffect& effect : reading_) model.transmitter_effects.push_back(effect.spec);
    return pv_of(model, search_.base);
  }

  // The model without effects, as given or within its uncertainty: whichever leaves less.
  std::vector<double> model_pv() const {
    std::vector<double> adjusted = adjusted_pv();
    return holdout_rmse(adjusted) < holdout_rmse(series_.pv_before) ? adjusted : series_.pv_before;
  }

  const std::optional<Learned>& learned_law() {
    if (!law_tried_ && !record_.closed_loop && !left_out("learned")) {
      law_ = learn(free_run(), search_.base, record_);
    }
    law_tried_ = true;
    return law_;
  }

  // Whether a law without a name does far better. Where noise and a quiet load account for what the
  // names leave, and where the names close nearly all, there is nothing to be better at.
  bool ousted() {
    if (left_.adequate || left_.closed > 1.0 - kOusts || !learned_law()) return false;
    std::vector<double> left(record_.pv.size());
    for (std::size_t k = 0; k < left.size(); ++k) left[k] = record_.pv[k] - series_.pv_after[k];
    return ousts(*learned_law(), left, record_.training, record_.quality.noise_rms);
  }

  // What of `pv` nothing can close.
  void weigh_rest(const std::vector<double>& pv, bool quiet) {
    const double noise = record_.quality.noise_rms;
    const double rmse = holdout_rmse(pv);
    const double left_rms = std::sqrt(std::max(0.0, rmse * rmse - noise * noise));
    const double before = holdout_rmse(series_.pv_before);
    const double nothing = std::max(model_fit_.least_rms, model_fit_.valve_rms);
    std::vector<double> error(pv.size());
    for (std::size_t k = 0; k < pv.size(); ++k) error[k] = record_.pv[k] - pv[k];
    static const std::vector<double> kUnknown;
    independence_ =
        test_independence({.error = error,
                           .counts = record_.used,
                           .sp = record_.record.has_sp() ? record_.sp : kUnknown,
                           .co = record_.closed_loop ? kUnknown : record_.co,
                           .stretch = holdout(),
                           .answer_s = plant::answer_s(record_.model),
                           .period_s = record_.record.period_s,
                           .left_rms = left_rms,
                           .nothing_rms = nothing,
                           .matters_rms = std::max(nothing, std::sqrt(kFollowingPart) * before)});
    result_.floor = {.transmitter_rmse = noise,
                     .load_tested = independence_.tested,
                     .why_not_tested = independence_.why_not};
    // A load that the model states is known, tested here or not.
    if (quiet && !independence_.follows()) {
      result_.floor.load_rmse = std::min(
          left_rms, independence_.tested ? model_fit_.largest_load_rms : stated_load_rms(model_));
    }
  }

  void take_misfits() {
    result_.before = misfit(series_.pv_before, result_.floor.rmse());
    result_.after = misfit(series_.pv_after, result_.floor.rmse());
  }

  // What no name explains, learned and proved on the holdout. Nobody knows whether what it leaves
  // is a load: the transmitter's floor is the only one.
  void learn_effect(const Learned& learned) {
    const Fit& base = search_.base;
    const double floor = result_.floor.transmitter_rmse;
    plant::LoopModel model = free_run().corrected(base.terms, base.point, base.solved);
    (learned.block == effects::Block::valve ? model.valve_effects : model.process_effects)
        .push_back(learned.spec);
    std::vector<double> pv = pv_of(model, base);
    const Misfit after = misfit(pv, floor);
    const double closed = gap_closed(result_.before.holdout_rmse, after.holdout_rmse, floor);
    const bool holds = std::isfinite(closed)
                           ? closed >= kPartlyClosed
                           : after.holdout_rmse <= kWorstHoldout * result_.before.holdout_rmse;
    if (!holds || after.holdout_rmse > result_.before.holdout_rmse) return;
    weigh_rest(pv, false);
    model.transmitter = model_.transmitter;
    model.controller = result_.corrected.controller;
    result_.corrected = std::move(model);
    result_.after = after;
    result_.outcome = Outcome::missing_effect;
    series_.pv_after = std::move(pv);
    learned_.emplace();
    learned_->spec = learned.spec;
    learned_->block = learned.block;
    learned_->confidence =
        most_confidence(std::min(kMostLearned, std::isfinite(closed) ? closed : kPartlyClosed));
    learned_->evidence = text(
        "no name fits as well; form %s, chosen by what it leaves on stretches that were left out, "
        "where it "
        "closes %.0f %% of the gap",
        learned.spec.options.at("form").c_str(), 100.0 * learned.closed);
  }

  void describe_rest() {
    result_.closed_loop = record_.closed_loop;
    result_.holdout_from_s = record_.record.seconds_at(record_.training_end);
    result_.load_intensity = learned_ ? 0.0 : left_.load_intensity;
    result_.rest = {.is_noise = left_.adequate,
                    .noise_ratio = left_.noise_ratio,
                    .kurtosis = left_.tail,
                    .answer_to_co = left_.answer,
                    .closed = left_.closed,
                    .quiet_rmse = left_.quiet_rmse};
    if (controller_.compared) {
      result_.controller_before_rmse = controller_.before_rmse;
      result_.controller_after_rmse = controller_.after_rmse;
    }
    if (!controller_.anti_windup.empty()) {
      result_.check.notes.push_back(
          {"anti-windup",
           "near its limits CO behaves as with anti_windup: " + controller_.anti_windup});
    }
    if (result_.outcome == Outcome::no_gap && left_.load_intensity > 0.0) {
      const std::string hidden = hidden_by_load(search_, model_fit_);
      if (!hidden.empty()) result_.check.notes.push_back({"load", hidden});
    }
    if (ousted_ && !learned_) {
      result_.check.notes.push_back(
          {"learned",
           "on stretches left out a law without a name does far better than the best names, but it "
           "fails on the last third",
           result_.holdout_from_s, record_.record.seconds_at(record_.record.size() - 1)});
    } else if (proof_ == Proof::refuted && decision_.believable && !learned_) {
      result_.check.notes.push_back(
          {"holdout", "the best explanation of the first two thirds fails on the last third",
           result_.holdout_from_s, record_.record.seconds_at(record_.record.size() - 1)});
    }
  }

  void name_effects() {
    std::vector<FoundEffect>& effects = result_.effects;
    if (kept_.other_settings) {
      effects.push_back(describe_controller(controller_, model_.controller.pid.gains));
    }
    effects.insert(effects.end(), reading_.begin(), reading_.end());
    for (FoundEffect& effect : describe_effects(kept_, proof_, search_, model_fit_)) {
      effect.confidence = most_confidence(effect.confidence);
      effect.evidence += doubt();
      if (repeats_with_set_point(effect.spec)) {
        effect.confidence = std::min(effect.confidence, kMostRepeating);
        effect.evidence +=
            "; its delay is the time between two moves of SP, with which every error "
            "of the model repeats";
      }
      effects.push_back(std::move(effect));
    }
    if (kept_.level && result_.outcome == Outcome::missing_effect) {
      FoundEffect effect = describe_level(*kept_.level, *level_, result_.before, result_.after);
      effect.confidence = most_confidence(confidence_after(effect.confidence, proof_));
      effect.evidence += doubt();
      effects.push_back(std::move(effect));
    }
    if (learned_) {
      effects.push_back(*learned_);
    } else if (result_.outcome == Outcome::missing_effect) {
      result_.steps = steps_of(search_, record_, free_run(), result_.floor.rmse());
      if (kept_.level) {
        result_.steps.push_back({kLevelName, Step::Change::added, result_.after.training_rmse,
                                 result_.after.holdout_rmse});
      }
    }
    result_.candidates = describe_tried(search_, model_fit_, result_.outcome);
    if (level_) {
      result_.candidates.push_back(
          describe_level_tried(*level_, search_, kept_.level.has_value(), result_.outcome));
    }
  }

  // Whether PV would feed back on itself after the very time between two moves of SP.
  bool repeats_with_set_point(const effects::EffectSpec& spec) const {
    const auto delay = spec.parameters.find("delay");
    if (spec.name != "recycle" || delay == spec.parameters.end() || !record_.record.has_sp()) {
      return false;
    }
    std::vector<double> apart_s;
    double last_s = kNone;
    for (std::size_t k = 1; k < record_.sp.size(); ++k) {
      if (record_.sp[k] == record_.sp[k - 1]) continue;
      const double now_s = record_.record.seconds_at(k);
      if (std::isfinite(last_s)) apart_s.push_back(now_s - last_s);
      last_s = now_s;
    }
    if (apart_s.empty()) return false;
    const double times = delay->second / numeric::median(std::move(apart_s));
    return times > 0.5 && std::abs(times - std::round(times)) < kRepeats;
  }

  // No name is surer than the test of what it leaves allows.
  double most_confidence(double confidence) const {
    if (independence_.follows()) return std::min(confidence, kMostFollowing);
    return independence_.tested ? confidence : std::min(confidence, kMostUntested);
  }
  std::string doubt() const {
    if (independence_.follows()) {
      return text("; what is left on the last third follows %s by %.2g rms: the name is not sure",
                  independence_.follows_sp ? "SP" : "CO", independence_.follows_rms);
    }
    if (independence_.tested) return {};
    return "; whether what is left on the last third is a load can't be tested: " +
           independence_.why_not;
  }

  void find_where() {
    std::vector<LocatedEffect> effects;
    if (!kept_.named.empty()) {
      effects = energies_of(fit(), kept_.level ? &level_->chosen.fit : nullptr, model_fit_.fitter,
                            record_);
    } else if (kept_.level) {
      effects = {{effects::Block::transmitter, 1.0}};
    }
    const bool controller_differs = controller_.mismatch || controller_.unexplained;
    result_.located =
        locate({.model = model_,
                .time_s = series_.time_s,
                .pv = series_.pv,
                .pv_before = series_.pv_before,
                .co = series_.co,
                .rmse = result_.before.rmse,
                .noise_floor_rmse = result_.floor.rmse(),
                .controller_rmse = controller_differs ? controller_.before_rmse : 0.0,
                .effects = effects,
                .likely = learned_                     ? learned_->block
                          : result_.candidates.empty() ? effects::Block::process
                                                       : result_.candidates.front().block});
  }

  void describe_remainder() {
    const double floor = result_.floor.rmse();
    if (!(result_.after.holdout_rmse > floor)) return;
    const double closed =
        gap_closed(result_.before.holdout_rmse, result_.after.holdout_rmse, floor);
    result_.remainder = {
        .rmse = result_.after.holdout_rmse,
        .share = 1.0 - closed,
        .looks_like = looks_like({.model = model_,
                                  .pv = series_.pv,
                                  .pv_after = series_.pv_after,
                                  .co = series_.co,
                                  .is_noise = left_.adequate && kept_.names_any()})};
    if (independence_.follows_sp) result_.remainder->depends_on.push_back("sp");
    if (independence_.follows_co) result_.remainder->depends_on.push_back("co");
  }

  // What is named is the controller's, and the plant's gap stays.
  bool plant_unexplained() const {
    return kept_.unexplained && kept_.other_settings && !kept_.names_any() && !kept_.by_reading;
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
                                    .plant_unexplained = plant_unexplained(),
                                    .with_load = result_.load_intensity > 0.0,
                                    .until_s = until_s_});
    if (taken_.late == 0) return;
    result_.sentence +=
        " CO was logged " + samples_off(taken_.late) + "; that is no effect of the loop.";
  }

  const Taken& taken_;
  const CheckedRecord& record_;
  const plant::LoopModel& model_;
  const Options& options_;
  std::vector<FoundEffect> reading_;
  ModelFit model_fit_;
  const Scale scale_;
  ControllerFinding controller_;
  SearchResult search_;
  std::optional<LevelFinding> level_;  // a level that the model does not state and the record shows
  Residuals left_;
  Decision decision_;
  Decision kept_;  // what of it the holdout left
  Trial trial_;
  Proof proof_ = Proof::holds;
  double until_s_ = kNone;     // s, from where on the names are not proved
  Independence independence_;  // of what is left
  bool law_tried_ = false;
  std::optional<Learned> law_;
  bool ousted_ = false;  // the names, by it
  std::optional<FoundEffect> learned_;
  Series series_;
  Result result_;
};

}  // namespace

Result find_gap(const LoopRecord& as_logged, const plant::LoopModel& model, const Options& options,
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
