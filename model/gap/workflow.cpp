// SPDX-License-Identifier: Apache-2.0
#include "model/gap/workflow.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/estimator/estimate.hpp"
#include "model/estimator/judge_test.hpp"
#include "model/gap/check.hpp"
#include "model/gap/constants.hpp"
#include "model/gap/controller.hpp"
#include "model/gap/independence.hpp"
#include "model/gap/locate.hpp"
#include "model/gap/logger.hpp"
#include "model/gap/model_run.hpp"
#include "model/gap/next_test.hpp"
#include "model/gap/prove.hpp"
#include "model/gap/record_check.hpp"
#include "model/gap/say.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::gap {
namespace {

using estimator::Estimate;
using numeric::text;

constexpr const char* kController = "controller_mismatch";
constexpr const char* kUnnamed = "unnamed";

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Probabilities of the hypotheses.
class Posterior {
 public:
  // A hypothesis that adds effects to the `chosen` ones counts for them: the rules for one more
  // effect reject the addition.
  Posterior(const Estimate& estimate, const std::vector<std::string>& chosen) {
    for (const auto& line : estimate.posterior) {
      const std::vector<std::string>& names = line.first;
      const bool adds = !chosen.empty() && std::all_of(chosen.begin(), chosen.end(),
                                                       [&](auto& n) { return contains(names, n); });
      add(adds ? chosen : names, line.second);
    }
    tidy();
  }

  double of(std::string_view name) const {
    double sum = 0.0;
    for (const Probability& h : list_) {
      if (contains(h.effects, name)) sum += h.probability;
    }
    return sum;
  }

  // Limits the probability of a name; what it loses is that of no name.
  void limit(std::string_view name, double most) {
    const double now = of(name);
    if (!(now > most)) return;
    for (Probability& h : list_) {
      if (contains(h.effects, name)) h.probability *= most / now;
    }
    add({kUnnamed}, now - most);
    tidy();
  }

  // An effect that was found without a fit of the plant, in addition to each hypothesis.
  void include(const std::string& name, double probability) {
    const std::vector<Probability> before = std::exchange(list_, {});
    for (const Probability& h : before) {
      std::vector<std::string> with = h.effects;
      with.push_back(name);
      add(with, probability * h.probability);
      add(h.effects, (1.0 - probability) * h.probability);
    }
    tidy();
  }

  std::vector<Probability> take() && { return std::move(list_); }

 private:
  void add(const std::vector<std::string>& names, double probability) {
    const auto same = std::find_if(list_.begin(), list_.end(),
                                   [&](const Probability& h) { return h.effects == names; });
    if (same != list_.end()) {
      same->probability += probability;
    } else {
      list_.push_back({names, probability});
    }
  }

  // Likeliest first, without the unlikely ones, with the sum 1.
  void tidy() {
    constexpr double kLeast = 0.01;
    std::erase_if(list_, [](const Probability& h) { return !(h.probability >= kLeast); });
    std::stable_sort(list_.begin(), list_.end(), [](const Probability& a, const Probability& b) {
      return a.probability > b.probability;
    });
    double sum = 0.0;
    for (const Probability& h : list_) sum += h.probability;
    for (Probability& h : list_) h.probability /= sum;
  }

  std::vector<Probability> list_;
};

std::string samples_off(int late) {
  const int samples = std::abs(late);
  return std::to_string(samples) + (samples > 1 ? " samples" : " sample") +
         (late > 0 ? " too late" : " too early");
}

// Whether one period is a whole multiple of the other, from 2 to 20.
bool is_multiple(double a_s, double b_s) {
  constexpr double kMost = 20.0;
  constexpr double kAlike = 0.01;  // of the shorter period
  const double ratio = std::max(a_s, b_s) / std::min(a_s, b_s);
  const double whole = std::nearbyint(ratio);
  return whole >= 2.0 && whole <= kMost && std::abs(ratio - whole) <= kAlike;
}

// The record as it is compared.
struct Taken {
  LoopRecord given;
  plant::LoopModel model;  // at the period of the record
  CheckedRecord checked;
  int late = 0;               // samples, by which CO was logged too late
  bool other_period = false;  // than that of the model
};

Taken take(const LoopRecord& as_logged, const plant::LoopModel& model, const Options& options) {
  Taken taken{.given = as_logged, .model = model, .checked = {}};
  const double period_s = as_logged.period_s;
  const bool differs =
      std::abs(period_s - model.sample_time_s) > 0.01 * std::min(period_s, model.sample_time_s);
  if (differs && period_s > 0.0 && model.sample_time_s > 0.0 &&
      (as_logged.pv_as_stored || is_multiple(period_s, model.sample_time_s))) {
    taken.other_period = true;
    taken.model.sample_time_s = period_s;
    // The controller moved CO between the samples of a slower record.
    const double ahead = 0.5 * (1.0 - model.sample_time_s / period_s);
    std::vector<double>& co = taken.given.co;
    for (std::size_t k = 0; options.co_in_lines && ahead > 0.0 && k + 1 < co.size(); ++k) {
      if (std::isfinite(co[k + 1])) co[k] += ahead * (co[k + 1] - co[k]);
    }
  }
  taken.checked = check(taken.given, taken.model);
  if (taken.checked.quality.usable && !taken.other_period) {
    taken.late = logger_shift(taken.given, taken.model);
  }
  if (taken.late == 0) return taken;
  taken.given = with_co_moved_back(taken.given, taken.late);
  taken.checked = check(taken.given, taken.model);
  taken.checked.quality.notes.push_back(
      {"logger", "CO is logged " + samples_off(taken.late) +
                     " against PV. It is moved by as much, and is no dead time of the loop."});
  return taken;
}

// Steps of the workflow after the check. Each uses the results of the ones before.
class Workflow {
 public:
  Workflow(const Taken& taken, const plant::LoopModel& model, const Options& options,
           const ParallelFor& parallel)
      : taken_(taken),
        record_(taken.checked),
        model_(model),
        options_(options),
        parallel_(parallel),
        reading_(describe_reading(record_.reading, model)) {
    std::erase_if(reading_, [&](const FoundEffect& e) {
      return contains(options_.search.without, e.spec.name);
    });
    const bool compares = !record_.closed_loop && !taken.other_period && !options.archive &&
                          !taken.given.pv_as_stored &&
                          !contains(options_.search.without, kController);
    if (compares) controller_ = compare_controller(record_.record, record_.model);
  }

  Result run(Result result, const std::function<void(double)>& progress) {
    result_ = std::move(result);
    estimate(progress);
    decide();
    describe();
    plan_next_test();
    return std::move(result_);
  }

 private:
  // The estimator's answer. Names that an archive may have produced are left out.
  void estimate(const std::function<void(double)>& progress) {
    estimator::Observed observed{record_.record.period_s, record_.co, record_.pv, record_.measured};
    plant::LoopModel model = record_.model;
    // The noise is at least that of the check, which knows flat and stored samples.
    double noise = record_.quality.noise_rms;
    if (options_.archive) noise = std::hypot(noise, archive_error(model_, *options_.archive));
    model.transmitter.resolution = std::max(model_.transmitter.resolution, std::sqrt(12.0) * noise);
    estimator::Options how{.without = options_.search.without,
                           .most_effects = options_.search.several && !options_.archive ? 3U : 1U,
                           .level_known = !record_.closed_loop && !options_.search.level_of_record,
                           .largest_disturbance = options_.search.load ? options_.largest_load : 0,
                           .progress = progress};
    for (const FoundEffect& effect : reading_) how.without.push_back(effect.spec.name);
    // A leak is a lower gain and a level.
    if (!how.level_known) how.without.emplace_back("leakage");
    constexpr int kMostSearches = 3;
    for (int search = 0; search < kMostSearches; ++search) {
      found_ = estimator::estimate(observed, model, how, parallel_);
      if (!options_.archive) return;
      bool again = false;
      for (const estimator::Found& found : found_.effects) {
        if (!doubtful(found.spec, found.block, model_, *options_.archive)) continue;
        how.without.push_back(found.spec.name);
        again = true;
      }
      hidden_by_archive_ = hidden_by_archive_ || again || !options_.archive->known;
      if (!again) return;
    }
  }

  bool named() const { return !effects_.empty(); }

  void decide() {
    result_.floor = {.transmitter_rmse = found_.noise_rms,
                     .load_rmse = std::sqrt(std::max(
                         0.0, found_.floor * found_.floor - found_.noise_rms * found_.noise_rms)),
                     .load_tested = !record_.closed_loop};
    if (record_.closed_loop) result_.floor.why_not_tested = "CO was not measured";
    series_ = series();
    if (found_.verdict == estimator::Verdict::missing_effect) effects_ = found_.effects;
    series_.pv_before = given_pv();
    series_.pv_after = named()          ? corrected_pv()
                       : is_explained() ? found_.pv_before
                                        : series_.pv_before;
    take_misfits();
    if (options_.archive && is_hidden(result_.before)) {
      effects_.clear();
      found_.verdict = estimator::Verdict::no_gap;
      series_.pv_after = series_.pv_before;
      take_misfits();
    }
    closed_ =
        gap_closed(result_.before.holdout_rmse, result_.after.holdout_rmse, result_.floor.rmse());
    const bool unsure = options_.archive && !options_.archive->known;
    if (named() && (closed_ < kPartlyClosed || unsure)) take_back();
    if (!named() && !(result_.after.rmse < result_.before.rmse)) {
      series_.pv_after = series_.pv_before;
      take_misfits();
    }
    const bool explained = named() || is_explained();
    const bool other_settings = controller_.mismatch && (controller_.exact || explained);
    plant_unexplained_ = !explained;
    if (named() || !reading_.empty() || other_settings) {
      result_.outcome = Outcome::missing_effect;
    } else {
      result_.outcome =
          explained && !controller_.unexplained ? Outcome::no_gap : Outcome::unexplained;
    }
    corrected_model(other_settings);
    if (!reading_.empty() && !record_.closed_loop) {
      // As the transmitter shows it.
      plant::LoopModel model = result_.corrected;
      model.sample_time_s = record_.model.sample_time_s;
      series_.pv_after = free_run(model, record_.co, record_.pv, record_.measured);
      take_misfits();
    }
    name_effects(other_settings);
  }

  // Whether the archive itself can account for the error.
  bool is_hidden(const Misfit& error) const {
    constexpr double kWithin = 1.5;  // floors
    return std::max(error.rmse, error.holdout_rmse) <= kWithin * result_.floor.rmse();
  }

  bool is_explained() const {
    return found_.verdict == estimator::Verdict::no_gap ||
           (found_.verdict == estimator::Verdict::missing_effect && named());
  }

  void take_back() {
    for (const estimator::Found& found : effects_) taken_back_.push_back(found.spec.name);
    effects_.clear();
    found_.verdict = estimator::Verdict::unexplained;
    series_.pv_after = series_.pv_before;
    take_misfits();
  }

  std::vector<double> given_pv() const {
    return record_.closed_loop ? closed_loop(record_.model, record_.sp, record_.pv.front())
                               : free_run(record_.model, record_.co, record_.pv, record_.measured);
  }
  std::vector<double> corrected_pv() const {
    if (!record_.closed_loop) return found_.pv_after;
    plant::LoopModel model = found_.corrected;
    model.controller = record_.model.controller;
    return closed_loop(model, record_.sp, record_.pv.front());
  }

  Misfit misfit(const std::vector<double>& pv) const {
    return misfit_of(record_.pv, pv, record_.used, record_.training_end, result_.floor.rmse());
  }
  void take_misfits() {
    result_.before = misfit(series_.pv_before);
    result_.after = misfit(series_.pv_after);
  }

  Series series() const {
    Series s;
    for (std::size_t k = 0; k < record_.record.size(); ++k) {
      s.time_s.push_back(record_.record.seconds_at(k));
    }
    s.pv = record_.record.pv;
    for (std::size_t k = 0; k < s.pv.size(); ++k) {
      if (!record_.used[k]) s.pv[k] = kNone;
    }
    s.sp = record_.sp;
    s.co = record_.co;
    s.stem = taken_.given.stem;
    s.co_before = controller_.before;
    s.co_after = controller_.after;
    return s;
  }

  // The given model with the effects, in the layout and with the noise of the given one.
  void corrected_model(bool other_settings) {
    plant::LoopModel& out = result_.corrected;
    out = model_;
    if (named() && effects_.front().spec.name != "learned") {
      out.process = found_.corrected.process;
      out.valve_effects = found_.corrected.valve_effects;
      out.process_effects = found_.corrected.process_effects;
      const auto add = [](std::vector<effects::EffectSpec>& list,
                          const std::vector<effects::EffectSpec>& found) {
        for (const effects::EffectSpec& spec : found) {
          if (std::none_of(list.begin(), list.end(), [&](const effects::EffectSpec& s) {
                return s.name == spec.name && s.parameters == spec.parameters;
              })) {
            list.push_back(spec);
          }
        }
      };
      add(out.transmitter_effects, found_.corrected.transmitter_effects);
      add(out.disturbances, found_.corrected.disturbances);
    }
    for (const FoundEffect& effect : reading_) out.transmitter_effects.push_back(effect.spec);
    if (other_settings) {
      out.controller.pid.gains.kp = controller_.kp;
      out.controller.pid.gains.ki = controller_.ki;
    }
    result_.adjusted = model_;
    result_.adjusted.process = found_.adjusted.process;
  }

  // Names, probabilities and evidence.
  void name_effects(bool other_settings) {
    std::vector<std::string> chosen;
    for (const estimator::Found& found : effects_) chosen.push_back(found.spec.name);
    Posterior posterior(found_, chosen);
    for (const std::string& name : taken_back_) posterior.limit(name, 0.0);
    std::vector<FoundEffect>& out = result_.effects;
    for (const estimator::Found& found : effects_) {
      FoundEffect effect = described(found);
      posterior.limit(effect.spec.name, std::min(found.confidence, most_confidence(effect)));
      out.push_back(std::move(effect));
    }
    if (other_settings) {
      out.push_back(describe_controller(controller_, model_.controller.pid.gains));
    }
    out.insert(out.end(), reading_.begin(), reading_.end());
    for (std::size_t i = effects_.size(); i < out.size(); ++i) {
      posterior.include(out[i].spec.name, out[i].confidence);
    }
    for (FoundEffect& effect : out) effect.confidence = posterior.of(effect.spec.name);
    result_.posterior = std::move(posterior).take();
    for (std::size_t i = 0; i < effects_.size(); ++i) add_alternatives(out[i]);
  }

  // Score of the best hypothesis with or without a name, nats.
  double best_score(std::string_view name, bool with) const {
    double best = kNone;
    for (const estimator::Ranked& r : found_.ranked) {
      const bool has = std::any_of(r.effects.begin(), r.effects.end(),
                                   [&](const effects::EffectSpec& s) { return s.name == name; });
      if (has == with && !(best >= r.score)) best = r.score;
    }
    return best;
  }

  FoundEffect described(const estimator::Found& found) const {
    FoundEffect effect;
    effect.spec = found.spec;
    effect.block = found.block;
    if (!found.description.empty()) effect.spec.options["description"] = found.description;
    const effects::Descriptor* info = effects::find_effect(found.spec.name);
    for (const auto& [name, interval] : found.intervals) {
      std::array<double, 2> within = interval.within;
      const effects::ParameterInfo* parameter =
          info != nullptr ? effects::find_parameter(*info, name) : nullptr;
      if (parameter != nullptr) {
        within = {std::max(within[0], parameter->low), std::min(within[1], parameter->high)};
      }
      effect.interval[name] = within;
    }
    effect.lead_nats = best_score(found.spec.name, true) - best_score(found.spec.name, false);
    const std::string parameters = parameters_text(found.spec);
    effect.evidence =
        "adding it" + (parameters.empty() ? "" : " (" + parameters + ")") +
        text(" reduces the RMS error of the free run from %.3g to %.3g on the fitted part",
             found_.before.training, found_.after.training);
    if (std::isfinite(effect.lead_nats)) {
      effect.evidence +=
          text("; the best explanation without it is %s", how_likely_without(effect.lead_nats));
    }
    if (found.spec.name == "output_bias" && !model_.process.level) {
      effect.evidence +=
          "; the model does not state PV at CO 0. If this value is that of the loop (room "
          "temperature, static head, base pressure), write it to process.level; otherwise PV has "
          "an error";
    }
    return effect;
  }

  // The most that the record allows for a name; the reason is added to its evidence.
  double most_confidence(FoundEffect& effect) const {
    double most = 1.0;
    const auto limit = [&](double value, const std::string& reason) {
      most = std::min(most, value);
      effect.evidence += "; " + reason;
    };
    if (closed_ < kClosed) {
      limit(kPartlyConfidence,
            text("it closes %.0f %% of the squared gap on unseen data", 100.0 * closed_));
    }
    if (record_.closed_loop) limit(kMostUntested, "CO was not measured");
    if (const char* input = what_is_left_follows()) {
      limit(kMostFollowing, text("what is left of PV on unseen data follows %s", input));
    }
    if (options_.archive || taken_.other_period) {
      limit(kMostResampled, "CO between the samples is unknown");
    }
    const effects::Descriptor* info = effects::find_effect(effect.spec.name);
    if (info != nullptr && info->more_by != nullptr) {
      const auto interval = effect.interval.find(info->more_by);
      if (interval != effect.interval.end() && !(interval->second[0] > 0.0)) {
        limit(kMostLikeSimpler,
              text("%s could also be 0: a simpler effect may be as likely", info->more_by));
      }
    }
    if (effect.block == effects::Block::valve &&
        size_of(effect.spec) > kLargeValveEffect * model_.controller.pid.output_span()) {
      limit(kMostLarge, text("it exceeds %.0f %% of the output's span: an error of the model "
                             "(gain, level or units) is more likely",
                             100.0 * kLargeValveEffect));
    }
    if (repeats_with_set_point(effect.spec)) {
      limit(kMostRepeating,
            "its delay is the time between two moves of SP, with which every error of the model "
            "repeats");
    }
    return most;
  }

  // "SP", "CO", or null: nothing, or it can't be told.
  const char* what_is_left_follows() const {
    const double left = result_.after.holdout_rmse;
    const double noise = result_.floor.transmitter_rmse;
    const double left_rms = std::sqrt(std::max(0.0, left * left - noise * noise));
    std::vector<double> error(record_.pv.size());
    for (std::size_t k = 0; k < error.size(); ++k) error[k] = record_.pv[k] - series_.pv_after[k];
    static const std::vector<double> kUnknown;
    const Independence found =
        test_independence({.error = error,
                           .counts = record_.used,
                           .sp = record_.record.has_sp() ? record_.sp : kUnknown,
                           .co = record_.closed_loop ? kUnknown : record_.co,
                           .stretch = {record_.training_end, error.size()},
                           .answer_s = plant::answer_s(record_.model),
                           .period_s = record_.record.period_s,
                           .left_rms = left_rms,
                           .nothing_rms = result_.floor.rmse(),
                           .matters_rms = kFollows * left_rms});
    return found.follows_sp ? "SP" : found.follows_co ? "CO" : nullptr;
  }

  // The largest band, jump or flow, CO units. A position in the travel does not count.
  static double size_of(const effects::EffectSpec& spec) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    double size = 0.0;
    for (const auto& [name, value] : spec.parameters) {
      const effects::ParameterInfo* parameter =
          info != nullptr ? effects::find_parameter(*info, name) : nullptr;
      const bool is_place = name == "position" || name == "travel_limit";
      if (parameter != nullptr && !is_place && std::string_view(parameter->unit) == "CO units") {
        size = std::max(size, value);
      }
    }
    return size;
  }

  // Whether PV would feed back on itself after the time between two moves of SP.
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

  // Names of the likelier hypotheses without this effect, and its parts.
  void add_alternatives(FoundEffect& effect) const {
    constexpr double kLikely = 0.05;
    const auto add = [&](const std::string& name) {
      const bool chosen =
          std::any_of(result_.effects.begin(), result_.effects.end(),
                      [&](const FoundEffect& other) { return other.spec.name == name; });
      if (!chosen && name != kUnnamed && !contains(effect.alternatives, name)) {
        effect.alternatives.push_back(name);
      }
    };
    for (const Probability& h : result_.posterior) {
      if (h.probability < kLikely || contains(h.effects, effect.spec.name)) continue;
      for (const std::string& name : h.effects) add(name);
    }
    if (const effects::Descriptor* info = effects::find_effect(effect.spec.name)) {
      for (const char* part : info->made_of) add(part);
    }
  }

  // Everything that follows from the names.
  void describe() {
    result_.closed_loop = record_.closed_loop;
    result_.holdout_from_s = record_.record.seconds_at(record_.training_end);
    result_.load_intensity = chosen() != nullptr ? chosen()->error.disturbance : 0.0;
    const double floor = result_.floor.rmse();
    result_.rest = {
        .is_noise = result_.after.training_rmse <= kFewFloors * floor,
        .closed = gap_closed(result_.before.training_rmse, result_.after.training_rmse, floor),
        .quiet_rmse = std::hypot(floor, found_.law_error)};
    if (controller_.compared) {
      result_.controller_before_rmse = controller_.before_rmse;
      result_.controller_after_rmse = controller_.after_rmse;
    }
    if (named()) add_steps();
    add_candidates();
    if (result_.outcome != Outcome::no_gap) {
      find_where();
      describe_remainder();
    }
    add_notes();
    result_.sentence = sentence_of({.outcome = result_.outcome,
                                    .effects = result_.effects,
                                    .before = result_.before,
                                    .after = result_.after,
                                    .floor = floor,
                                    .remainder = result_.remainder,
                                    .best = taken_back_,
                                    .closed_loop = result_.closed_loop,
                                    .plant_unexplained = plant_unexplained_,
                                    .with_load = result_.load_intensity > 0.0});
    if (taken_.late != 0) {
      result_.sentence +=
          " CO was logged " + samples_off(taken_.late) + "; that is no effect of the loop.";
    }
    result_.series = std::move(series_);
  }

  const estimator::Ranked* chosen() const {
    const auto it = std::find_if(found_.ranked.begin(), found_.ranked.end(),
                                 [&](const auto& r) { return r.title == found_.chosen; });
    return it == found_.ranked.end() ? nullptr : &*it;
  }

  // The best hypothesis with some of the chosen effects; null if it was not searched.
  const estimator::Ranked* part_of_chosen(std::size_t effects, std::string_view without) const {
    for (const estimator::Ranked& r : found_.ranked) {
      const bool part = std::all_of(r.effects.begin(), r.effects.end(), [&](const auto& spec) {
        return spec.name != without &&
               std::any_of(effects_.begin(), effects_.end(),
                           [&](const estimator::Found& f) { return f.spec.name == spec.name; });
      });
      if (r.effects.size() == effects && part) return &r;
    }
    return nullptr;
  }

  // One effect after another.
  void add_steps() {
    std::vector<std::string> before;
    for (std::size_t count = 1; count < effects_.size(); ++count) {
      const estimator::Ranked* part = part_of_chosen(count, "");
      if (part == nullptr) continue;
      add_step(*part, before);
    }
    for (const estimator::Found& found : effects_) {
      if (contains(before, found.spec.name)) continue;
      result_.steps.push_back(
          {found.spec.name, result_.after.training_rmse, result_.after.holdout_rmse});
    }
  }
  void add_step(const estimator::Ranked& part, std::vector<std::string>& before) {
    for (const effects::EffectSpec& spec : part.effects) {
      if (contains(before, spec.name)) continue;
      before.push_back(spec.name);
      result_.steps.push_back({spec.name, part.left.training, part.left.holdout});
    }
  }

  void add_candidates() {
    double none = 0.0;
    double best = 0.0;
    for (const estimator::Ranked& r : found_.ranked) {
      if (r.effects.empty()) none = r.score;
    }
    if (chosen() != nullptr) best = chosen()->score - none;
    for (const estimator::Ranked& r : found_.ranked) {
      if (r.effects.size() != 1 || !r.named) continue;
      TriedCandidate tried{.name = r.effects[0].name,
                           .block = r.blocks[0],
                           .spec = r.effects[0],
                           .rmse = r.left.training,
                           .score = r.score - none,
                           .chosen = false,
                           .why_not = {}};
      const auto same = [&](const TriedCandidate& c) { return c.name == tried.name; };
      if (std::any_of(result_.candidates.begin(), result_.candidates.end(), same)) continue;
      tried.chosen = std::any_of(effects_.begin(), effects_.end(),
                                 [&](const auto& f) { return f.spec.name == tried.name; });
      if (!tried.chosen) tried.why_not = why_not(tried, best);
      result_.candidates.push_back(std::move(tried));
    }
  }
  std::string why_not(const TriedCandidate& tried, double best) const {
    if (result_.outcome == Outcome::no_gap) return "not needed: the model explains the record";
    if (!named()) {
      return text("leaves an RMS error of %.3g of %.3g", tried.rmse, result_.before.training_rmse);
    }
    if (best - tried.score < kTooClose) {
      return text("cannot be distinguished here: RMS error %.3g, chosen %.3g", tried.rmse,
                  result_.after.training_rmse);
    }
    return text("RMS error %.3g, chosen %.3g: %s", tried.rmse, result_.after.training_rmse,
                how_likely_without(best - tried.score));
  }

  // The error that returns without each effect.
  std::vector<LocatedEffect> energies() const {
    if (effects_.size() <= 1) {
      if (named()) return {{effects_[0].block, 1.0}};
      return {};
    }
    std::vector<LocatedEffect> out;
    const double whole = found_.after.training;
    for (const estimator::Found& found : effects_) {
      const estimator::Ranked* part = part_of_chosen(effects_.size() - 1, found.spec.name);
      const double left = part != nullptr ? part->left.training : found_.before.training;
      out.push_back({found.block, std::max(0.0, left * left - whole * whole)});
    }
    return out;
  }

  void find_where() {
    const bool controller_differs = controller_.mismatch || controller_.unexplained;
    const std::vector<LocatedEffect> effects = energies();
    result_.located =
        locate({.model = record_.model,
                .time_s = series_.time_s,
                .pv = series_.pv,
                .pv_before = series_.pv_before,
                .co = series_.co,
                .rmse = result_.before.rmse,
                .noise_floor_rmse = result_.floor.rmse(),
                .controller_rmse = controller_differs ? controller_.before_rmse : 0.0,
                .effects = effects,
                .likely = result_.candidates.empty() ? effects::Block::process
                                                     : result_.candidates.front().block});
  }

  void describe_remainder() {
    const double floor = result_.floor.rmse();
    if (!(result_.after.holdout_rmse > floor)) return;
    const bool hidden = hidden_by_archive_ && result_.outcome == Outcome::unexplained;
    result_.remainder = {
        .rmse = result_.after.holdout_rmse,
        .share = 1.0 - gap_closed(result_.before.holdout_rmse, result_.after.holdout_rmse, floor),
        .looks_like = hidden ? LooksLike::compression
                             : looks_like({.model = record_.model,
                                           .pv = series_.pv,
                                           .pv_after = series_.pv_after,
                                           .co = series_.co,
                                           .is_noise = result_.rest.is_noise && named()})};
    // A law of CO without a name explains a part of it.
    if (found_.flexible_lead > kFurtherGain &&
        found_.with_flexible.holdout < found_.after.holdout) {
      result_.remainder->depends_on.emplace_back("co");
    }
  }

  void add_notes() {
    std::vector<RecordNote>& notes = result_.check.notes;
    if (!controller_.anti_windup.empty()) {
      notes.push_back({"anti-windup", "near its limits CO behaves as with anti_windup: " +
                                          controller_.anti_windup});
    }
    if (result_.outcome == Outcome::no_gap && result_.after.rmse < result_.before.rmse) {
      const plant::ProcessParameters& moved = result_.adjusted.process;
      const plant::ProcessParameters& given = model_.process;
      notes.push_back(
          {"process",
           text("within its uncertainty the process fits best with gain %.4g (model: %.4g)",
                moved.gain, given.gain) +
               (given.integrating() ? std::string()
                                    : text(", time constant %.4g s (%.4g s)", moved.time_constant_s,
                                           given.time_constant_s)) +
               text(", dead time %.4g s (%.4g s): RMS error %.3g", moved.dead_time_s,
                    given.dead_time_s, result_.after.rmse)});
    }
    if (!taken_back_.empty()) {
      notes.push_back({"holdout",
                       "the best explanation of the first two thirds fails on the last third",
                       result_.holdout_from_s, record_.record.seconds_at(record_.pv.size() - 1)});
    }
    if (named() && effects_.front().spec.name == "learned") {
      notes.push_back({"learned",
                       "model.corrected.yaml does not contain this law: a model file has no key "
                       "for it"});
    }
    if (options_.archive) notes.push_back({"compressed", archive_note(model_, *options_.archive)});
    if (taken_.other_period) {
      notes.push_back(
          {"sample_time",
           text("The record has a sample every %g s, the model every %g s: CO between the samples "
                "is unknown, and the controller is not compared.",
                record_.record.period_s, model_.sample_time_s)});
    }
  }

  // Two or three likely explanations, and the loop as it was last. Without SP the controller is a
  // guess, and a test would be, too.
  void plan_next_test() {
    if (record_.closed_loop || options_.archive || taken_.other_period ||
        !record_.record.has_sp()) {
      return;
    }
    estimator::TestStart start = test_start(model_, record_.sp.back(), record_.co.back());
    start.disturbance = result_.load_intensity;
    gap::plan_next_test(found_, result_.posterior, std::move(start), parallel_, result_);
  }

  const Taken& taken_;
  const CheckedRecord& record_;
  const plant::LoopModel& model_;
  const Options& options_;
  const ParallelFor& parallel_;
  std::vector<FoundEffect> reading_;
  ControllerFinding controller_;
  Estimate found_;
  std::vector<estimator::Found> effects_;  // of the estimator, that hold on the last third
  std::vector<std::string> taken_back_;    // names that do not
  double closed_ = kNone;                  // share of the gap, last third
  bool hidden_by_archive_ = false;
  bool plant_unexplained_ = false;
  Series series_;
  Result result_;
};

}  // namespace

Result find_gap(const LoopRecord& as_logged, const plant::LoopModel& model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress) {
  const Taken taken = take(as_logged, model, options);
  Result result;
  result.model = model;
  result.corrected = model;
  result.adjusted = model;
  result.check = taken.checked.quality;
  if (!result.check.usable) return result;
  result = Workflow(taken, model, options, parallel).run(std::move(result), progress);
  progress(1.0);
  return result;
}

}  // namespace loopwarden::gap
