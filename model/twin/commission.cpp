// SPDX-License-Identifier: Apache-2.0
#include "model/twin/commission.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "model/analysis/identification.hpp"
#include "model/twin/polish.hpp"
#include "model/twin/twin_fit.hpp"
#include "model/twin/usable.hpp"
#include "model/effects/catalogue.hpp"
#include "model/gap/check.hpp"
#include "model/gap/constants.hpp"
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

// What the loop's own process does: moved, not named.
const std::vector<std::string> kOfTheProcess{"gain_change", "extra_dead_time"};
constexpr double kLoadTime_s = 300.0;  // a load that wanders is forgotten in this time
constexpr double kLeastSpMove =
    0.002;  // of the PV span: what is a move of SP in the twin's scenario
constexpr std::size_t kMostSpMoves = 400;
constexpr double kClearlyBest = 100.0;  // nats over the model alone
// What is left is none of the twin's business up to so many floors; from fewer on it is remarked.
constexpr double kFewFloors = 2.0;
constexpr double kRemarked = 1.5;
constexpr double kMatters = 0.5;  // of what is left: what follows SP or CO

bool of_the_day(const FoundEffect& effect) {
  return effect.block == Block::disturbance || effect.spec.name == "drift";
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

// The free run of a model under the record's CO, and how far it is from it.
class Runs {
 public:
  Runs(const numeric::LoopRecord& record, const LoopModel& model)
      : checked_(gap::check(record, model)) {}

  Stage stage(std::string name, const LoopModel& model) const {
    LoopModel quiet = plant::without_noise(model);
    quiet.sample_time_s = checked_.model.sample_time_s;
    Stage out{.name = std::move(name), .pv = {}};
    out.pv = checked_.closed_loop
                 ? gap::closed_loop(quiet, checked_.sp, checked_.pv.front())
                 : gap::free_run(quiet, checked_.co, checked_.pv, checked_.measured);
    const gap::Misfit misfit = gap::misfit_of(checked_.pv, out.pv, checked_.used, 0.0);
    out.rmse = misfit.training_rmse;
    out.holdout_rmse = misfit.holdout_rmse;
    return out;
  }
  gap::Misfit misfit(const Stage& stage, double floor) const {
    return gap::misfit_of(checked_.pv, stage.pv, checked_.used, floor);
  }
  const gap::CheckedRecord& checked() const noexcept { return checked_; }

 private:
  gap::CheckedRecord checked_;
};

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
std::string why_not_healthy(const FoundEffect& effect, const LoopModel& model, double limit) {
  if (effect.block != Block::valve) return "";
  const std::string& name = effect.spec.name;
  if (name == "low_air_supply" || name == "cam_obstruction" || name == "intermittent_stiction") {
    return text("The valve is not healthy: %s. %s", words(name).c_str(),
                effects::find_effect(name)->remedy);
  }
  const double size = size_percent(effect.spec, model.controller.pid.output_span());
  if (!(size > limit)) return "";
  return text("The valve is not healthy: %s of %.1f %% of span, at most %.1f %% is allowed. %s",
              words(name).c_str(), size, limit, effects::find_effect(name)->remedy);
}

class Commissioner {
 public:
  Commissioner(const Request& request, const gap::ParallelFor& parallel,
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
    const Runs runs(record_, out_.given);
    if (!runs.checked().quality.usable) return true;  // find_gap says why
    if (runs.stage("", other).rmse < runs.stage("", model_).rmse) {
      other.uncertainty = kIdentified;
      model_ = std::move(other);
    }
    return true;
  }

  void build() {
    const Runs runs(record_, out_.given);
    if (!runs.checked().quality.usable) {
      refuse(Outcome::not_usable, runs.checked().quality.refusal);
      return;
    }
    out_.stages.push_back(runs.stage("as given", out_.given));
    gap::Options options;
    options.search.without = kOfTheProcess;
    const double share = 1.0 / static_cast<double>(kMostRounds + request_.records.size() - 1);
    gap::Result last;
    bool adjusted = false;
    bool challenged = false;
    for (int round = 0; round < kMostRounds; ++round) {
      // First as any gap: faults are named best so. Then a healthy valve's friction and the
      // actuator's lag are what the twin is to have, not to be excused.
      options.search.allowances = round == 0;
      last = gap::find_gap(record_, model_, options, parallel_, [&](double done) {
        progress_(share * (static_cast<double>(round) + done));
      });
      if (!last.check.usable) {
        refuse(Outcome::not_usable, last.check.refusal);
        return;
      }
      load_ = last.load_intensity;
      if (is_faulty(last)) {
        if (!std::exchange(challenged, true)) {
          challenge(runs, last);
          round = -1;
          continue;
        }
        out_.effects = last.effects;
        finish(runs, last);
        out_.outcome = Outcome::not_healthy;
        return;
      }
      if (last.outcome == gap::Outcome::missing_effect) {
        take_in(last);
        out_.stages.push_back(runs.stage(names_of(last.effects), model_));
        adjusted = true;
      } else if (round > 0) {
        if (!adjusted) {
          model_ = last.adjusted;
          out_.stages.push_back(runs.stage("process", model_));
        }
        break;
      }
    }
    polish_all(runs);
    judge(runs, last);
    if (out_.outcome == Outcome::commissioned) prove_on_others(options, share);
    progress_(1.0);
  }

  // A characteristic that is not quite right, or a healthy friction where it is steep, makes faults
  // of other forms out of what it leaves: before a valve is called faulty, what else was found has
  // its numbers fitted without the fault. A fault that is a friction itself is not to be shared
  // with a healthy one.
  void challenge(const Runs& runs, gap::Result found) {
    const plant::ProcessUncertainty uncertainty = model_.uncertainty;
    bool friction = false;
    std::erase_if(found.effects, [&](const FoundEffect& effect) {
      if (why_not_healthy(effect, out_.given, request_.healthy_limit_percent).empty()) return false;
      std::erase(found.corrected.valve_effects, effect.spec);
      friction = friction ||
                 std::isfinite(size_percent(effect.spec, out_.given.controller.pid.output_span()));
      return true;
    });
    if (found.outcome == gap::Outcome::missing_effect) take_in(found);
    const Polished polished = polish(model_, record_, friction ? 0.0 : most_friction());
    model_ = polished.model;
    model_.uncertainty = uncertainty;
    note_friction(polished);
    out_.stages.push_back(runs.stage(
        found.effects.empty() ? "all parameters together" : names_of(found.effects), model_));
  }

  // Says why.
  bool is_faulty(const gap::Result& result) {
    const double limit = request_.healthy_limit_percent;
    for (const FoundEffect& effect : result.effects) {
      out_.why = why_not_healthy(effect, out_.given, limit);
      if (!out_.why.empty()) return true;
    }
    if (result.outcome != gap::Outcome::unexplained) return false;
    // Nothing is believed, but what comes nearest is a fault of the valve.
    const auto best =
        std::max_element(result.candidates.begin(), result.candidates.end(),
                         [](const auto& a, const auto& b) { return !(a.score >= b.score); });
    if (best == result.candidates.end() || !(best->score >= kClearlyBest)) return false;
    FoundEffect nearest;
    nearest.spec = best->spec;
    nearest.block = best->block;
    const std::string why = why_not_healthy(nearest, out_.given, limit);
    if (why.empty()) return false;
    out_.why = why + " (No effect explains the whole record; this one is the nearest.)";
    return true;
  }

  static std::string names_of(const std::vector<FoundEffect>& effects) {
    std::string names;
    for (const FoundEffect& effect : effects) {
      names += (names.empty() ? "" : " and ") + words(effect.spec.name);
    }
    return names;
  }

  void take_in(const gap::Result& result) {
    model_ = result.corrected;
    // What is found from here on is beside this.
    model_.uncertainty =
        plant::ProcessUncertainty{.gain = 0.1, .time_constant = 0.1, .dead_time = 0.1};
    for (const FoundEffect& effect : result.effects) {
      if (!of_the_day(effect)) {
        out_.effects.push_back(effect);
        continue;
      }
      out_.notes.push_back(words(effect.spec.name) +
                           ": a condition of that day, not of the loop; not included in the twin");
      day_.push_back(effect.spec);
    }
  }

  void note_friction(const Polished& polished) {
    if (!(polished.friction_percent > 0.0)) return;
    out_.notes.push_back(text("healthy valve friction: %.2f %% of span (included in the twin)",
                              polished.friction_percent));
  }

  double most_friction() const {
    if (!out_.given.has_valve) return 0.0;
    return 0.01 * request_.healthy_limit_percent * out_.given.controller.pid.output_span();
  }

  // What the rounds leave: numbers that were fitted one after the other, and friction too small to
  // be called missing.
  void polish_all(const Runs& runs) {
    const Polished polished = polish(model_, record_, most_friction());
    if (polished.rms_error > 0.0) load_ = polished.load_intensity;
    if (!polished.changed) return;
    model_ = polished.model;
    note_friction(polished);
    const bool friction = polished.friction_percent > 0.0;
    out_.stages.push_back(runs.stage(
        friction ? "friction and all parameters together" : "all parameters together", model_));
  }

  // The twin from the model that all the rounds made, and what is left of the gap.
  void finish(const Runs& runs, const gap::Result& last) {
    const Stage end = runs.stage("twin", model_);
    gap::Result result = last;
    // What a better model leaves is no floor.
    // The load of a healthy record is the twin's own: it counts whether SP moved or not.
    const double noise = last.check.noise_rms;
    const double quiet = std::min(last.rest.quiet_rmse, std::max(noise, end.holdout_rmse));
    result.floor.transmitter_rmse = noise;
    result.floor.load_rmse = std::sqrt(std::max(0.0, quiet * quiet - noise * noise));
    const double floor = result.floor.rmse();
    result.model = out_.given;
    result.effects = out_.effects;
    result.before = runs.misfit(out_.stages.front(), floor);
    result.after = runs.misfit(end, floor);
    result.series.pv_before = out_.stages.front().pv;
    result.series.pv_after = end.pv;
    out_.closed = gap::gap_closed(result.before.holdout_rmse, result.after.holdout_rmse, floor);
    if (out_.stages.back().pv != end.pv) out_.stages.push_back(end);

    const LoopModel whole = refitted(model_, record_);
    LoopModel twin = whole;
    twin.uncertainty = out_.given.uncertainty;
    if (out_.identified) twin.uncertainty = {};
    const auto is_of_the_day = [&](const effects::EffectSpec& spec) {
      return std::find(day_.begin(), day_.end(), spec) != day_.end();
    };
    std::erase_if(twin.disturbances, is_of_the_day);
    std::erase_if(twin.transmitter_effects, is_of_the_day);
    std::erase_if(twin.disturbances,
                  [](const effects::EffectSpec& spec) { return spec.name == "random_load"; });
    if (load_ > 0.0) {
      twin.disturbances.push_back(
          {"random_load", {{"intensity", load_}, {"time_constant", kLoadTime_s}}});
    }
    const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
    twin.transmitter.noise =
        std::sqrt(std::max(0.0, last.check.noise_rms * last.check.noise_rms - rounding * rounding));
    if (record_.has_sp()) twin.scenario = scenario_of(record_, twin);
    twin.twin = twin_fit(whole, record_);
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
  std::string what_it_follows(const Runs& runs, double left) const {
    const gap::CheckedRecord& checked = runs.checked();
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

  void judge(const Runs& runs, const gap::Result& last) {
    finish(runs, last);
    const double left = out_.gap->after.holdout_rmse;
    const double floor = out_.gap->floor.rmse();
    // Where the model that it began with is right already, there is no gap to close: then what is
    // left counts.
    const std::string follows = what_it_follows(runs, left);
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
    if (last.outcome == gap::Outcome::unexplained && left > kFewFloors * floor) {
      refuse(Outcome::not_explained,
             text("The remaining error of PV is %.1f times the noise floor, and no effect explains "
                  "it: it "
                  "looks like %s.",
                  left / floor,
                  last.remainder ? gap::to_text(last.remainder->looks_like) : "no known effect"));
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

  void prove_on_others(const gap::Options& options, double share) {
    for (std::size_t i = 1; i < request_.records.size(); ++i) {
      const numeric::LoopRecord& record = request_.records[i];
      const double begun = share * static_cast<double>(kMostRounds + static_cast<int>(i) - 1);
      const gap::Result result =
          gap::find_gap(record, out_.twin, options, parallel_,
                        [&](double done) { progress_(begun + share * done); });
      const auto number = static_cast<int>(i + 1);
      if (!result.check.usable) {
        refuse(Outcome::not_usable, text("Record %d: %s", number, result.check.refusal.c_str()));
        return;
      }
      for (const FoundEffect& effect : result.effects) {
        const std::string why = why_not_healthy(effect, out_.twin, request_.healthy_limit_percent);
        if (why.empty()) continue;
        refuse(Outcome::not_healthy, text("Record %d: %s", number, why.c_str()));
        return;
      }
      const bool differs = result.outcome == gap::Outcome::unexplained &&
                           result.before.holdout_rmse >
                               kFewFloors * std::max(result.floor.rmse(), result.rest.quiet_rmse);
      if (differs) {
        refuse(Outcome::not_explained, text("Record %d does not agree with the twin of the first "
                                            "record, and no effect explains "
                                            "the difference.",
                                            number));
        return;
      }
      out_.notes.push_back(text("record %d: rmse %.4g PV units, noise floor %.4g", number,
                                result.before.rmse, result.floor.rmse()));
    }
  }

  const Request& request_;
  const numeric::LoopRecord& record_;
  const gap::ParallelFor& parallel_;
  const std::function<void(double)>& progress_;
  Commissioning out_;
  LoopModel model_;
  std::vector<effects::EffectSpec> day_;
  double load_ = 0.0;
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

Commissioning commission(const Request& request, const gap::ParallelFor& parallel,
                         const std::function<void(double)>& progress) {
  return Commissioner(request, parallel, progress).run();
}

}  // namespace loopwarden::twin
