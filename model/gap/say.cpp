// SPDX-License-Identifier: Apache-2.0
#include "model/gap/say.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/gap/constants.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::gap {
namespace {

using numeric::text;

std::map<std::string, std::array<double, 2>> intervals(const Fit& fit, std::size_t index,
                                                       const Fitter& fitter,
                                                       const effects::EffectSpec& spec) {
  const std::vector<double> spread = fitter.spread(fit, index);
  const Candidate& term = *fit.terms[index];
  const std::vector<double>& searched = fit.point.searched[index];
  std::map<std::string, double> deviations;
  for (std::size_t j = 0; j < term.search.size(); ++j) deviations[term.search[j].name] = spread[j];
  for (std::size_t j = 0; j < term.solved.size(); ++j) {
    deviations[term.solved[j]] = spread[term.search.size() + j];
  }
  if (term.deviations != nullptr) term.deviations(searched, spread, spec, deviations);
  std::map<std::string, std::array<double, 2>> out;
  for (const auto& [name, value] : spec.parameters) {
    const auto it = deviations.find(name);
    if (it != deviations.end()) {
      out[name] = {value - k95 * it->second, value + k95 * it->second};
    }
  }
  return out;
}

// Up to where other fits are that the record can't tell from the chosen one.
void widen(std::map<std::string, std::array<double, 2>>& intervals,
           const effects::EffectSpec& other) {
  for (auto& [name, interval] : intervals) {
    const auto it = other.parameters.find(name);
    if (it == other.parameters.end()) continue;
    interval = {std::min(interval[0], it->second), std::max(interval[1], it->second)};
  }
}

std::string parameters_text(const effects::EffectSpec& spec) {
  std::string out;
  const effects::Descriptor* info = effects::find_effect(spec.name);
  const auto curve = spec.options.find("curve");
  if (curve != spec.options.end()) out = curve->second;
  for (const auto& [name, value] : spec.parameters) {
    const effects::ParameterInfo* parameter =
        info != nullptr ? effects::find_parameter(*info, name) : nullptr;
    if (parameter != nullptr && parameter->of_the_law) continue;
    out += (out.empty() ? "" : ", ") + name + " " + text("%.3g", value);
    if (parameter != nullptr && std::string_view(parameter->unit) != "-")
      out += std::string(" ") + parameter->unit;
  }
  if (out.empty() && !spec.table.empty()) out = text("table of %zu points", spec.table.size());
  return out;
}

effects::EffectSpec spec_of(const FreeRun& run, const Fit& fit, std::size_t index) {
  const plant::LoopModel model = run.corrected(fit.terms, fit.point, fit.solved);
  const char* name = fit.terms[index]->name;
  for (const auto* list : {&model.valve_effects, &model.process_effects, &model.transmitter_effects,
                           &model.disturbances}) {
    for (auto it = list->rbegin(); it != list->rend(); ++it) {
      if (it->name == name) return *it;
    }
  }
  return {};
}

// The largest of its sizes in CO units: bands, jumps, flows; a place in the travel is none.
double size_of(const effects::EffectSpec& spec) {
  constexpr std::array<std::string_view, 2> kPlaces{"position", "travel_limit"};
  const effects::Descriptor* info = effects::find_effect(spec.name);
  double size = 0.0;
  for (const auto& [name, value] : spec.parameters) {
    const effects::ParameterInfo* parameter =
        info != nullptr ? effects::find_parameter(*info, name) : nullptr;
    const bool is_place = std::find(kPlaces.begin(), kPlaces.end(), name) != kPlaces.end();
    if (parameter != nullptr && !is_place && std::string_view(parameter->unit) == "CO units") {
      size = std::max(size, value);
    }
  }
  return size;
}

// A lead in words.
const char* how_far(double nats) {
  return nats < kTooClose      ? "hardly less likely"
         : nats < kFurtherGain ? "less likely"
                               : "far less likely";
}

std::string why_not(const Hypothesis& tried, const SearchResult& search, Outcome outcome) {
  if (outcome == Outcome::no_gap) return "not needed: the model explains the record";
  if (!std::isfinite(tried.score)) return "no better than a simpler effect";
  if (!tried.placed) {
    return "acts at one valve position only, and CO never left and re-entered that position";
  }
  const double behind = search.chosen.score - tried.score;
  if (search.chosen.fit.terms.empty()) {
    return text("explains too little: %.3g of the rmse %.3g remains", tried.training_rmse,
                search.base_rmse);
  }
  if (behind < kTooClose) {
    return text("cannot be distinguished here: rmse %.3g, the chosen effect %.3g",
                tried.training_rmse, search.chosen.training_rmse);
  }
  return text("rmse %.3g, the chosen effect %.3g: %s", tried.training_rmse,
              search.chosen.training_rmse, how_far(behind));
}

}  // namespace

std::vector<FoundEffect> describe_effects(const Decision& decision, Proof proof,
                                          const SearchResult& search, const ModelFit& model_fit) {
  const Fit& fit = search.chosen.fit;
  std::vector<FoundEffect> out;
  for (std::size_t i = 0; i < decision.named.size(); ++i) {
    const NamedEffect& named = decision.named[i];
    FoundEffect effect;
    effect.spec = spec_of(model_fit.run, fit, i);
    effect.block = fit.terms[i]->block;
    effect.interval = intervals(fit, i, model_fit.fitter, effect.spec);
    for (const Hypothesis& h : search.alike) {
      widen(effect.interval, spec_of(model_fit.run, h.fit, i));
    }
    effect.confidence = confidence_after(named.confidence, proof);
    effect.lead_nats = named.lead_nats;
    effect.alternatives = named.alternatives;
    std::string doubt;
    if (const effects::Descriptor* info = effects::find_effect(named.name)) {
      const auto interval =
          info->more_by != nullptr ? effect.interval.find(info->more_by) : effect.interval.end();
      if (interval != effect.interval.end() && !(interval->second[0] > 0.0)) {
        effect.confidence = std::min(effect.confidence, kMostLikeSimpler);
        doubt = text("; %s could also be 0: a simpler effect may be as likely", info->more_by);
      }
      for (const char* part : info->made_of) {
        if (std::find(effect.alternatives.begin(), effect.alternatives.end(), part) ==
            effect.alternatives.end()) {
          effect.alternatives.emplace_back(part);
        }
      }
    }
    const control::PidSettings& pid = model_fit.run.model().controller.pid;
    if (effect.block == effects::Block::valve &&
        size_of(effect.spec) > kLargeValveEffect * pid.output_span()) {
      effect.confidence = std::min(effect.confidence, kMostLarge);
      doubt += text(
          "; more than %.0f %% of the output's span: more likely the model is wrong (gain, "
          "level or units)",
          100.0 * kLargeValveEffect);
    }
    effect.evidence =
        text(
            "adding it (%s) reduces the rmse of the free run from %.3g to %.3g on the "
            "fitted data; the best explanation without it is %s",
            parameters_text(effect.spec).c_str(), search.base_rmse, search.chosen.training_rmse,
            how_far(named.lead_nats)) +
        doubt;
    out.push_back(std::move(effect));
  }
  return out;
}

FoundEffect describe_level(const NamedEffect& named, const LevelFinding& level,
                           const Misfit& before, const Misfit& after) {
  FoundEffect effect;
  effect.spec = {kLevelName, {{"bias", level.level}}};
  effect.block = effects::Block::transmitter;
  effect.interval["bias"] = {level.level - k95 * level.spread, level.level + k95 * level.spread};
  effect.confidence = named.confidence;
  effect.lead_nats = named.lead_nats;
  effect.evidence = text(
      "the model does not state PV at CO 0 (process.level), and the record shows %.4g there: "
      "with it the free run's rmse falls from %.3g to %.3g on the data of the fit. If this "
      "is the loop's own (room temperature, static head, base pressure), write it to "
      "process.level; only otherwise is PV off",
      level.level, before.training_rmse, after.training_rmse);
  return effect;
}

TriedCandidate describe_level_tried(const LevelFinding& level, const SearchResult& search,
                                    bool named, Outcome outcome) {
  TriedCandidate tried;
  tried.name = kLevelName;
  tried.block = effects::Block::transmitter;
  tried.spec = {kLevelName, {{"bias", level.level}}};
  tried.rmse = search.base_rmse;
  tried.score = level.lead_nats;
  tried.chosen = named && outcome == Outcome::missing_effect;
  if (!tried.chosen) tried.why_not = "is a part of every fit, and more than it is missing";
  return tried;
}

FoundEffect describe_controller(const ControllerFinding& found, const control::PidGains& model) {
  FoundEffect effect;
  effect.spec = {"controller_mismatch", {{"kp", found.kp}, {"ki", found.ki}}};
  effect.block = effects::Block::controller;
  effect.confidence = controller_confidence();
  effect.interval["kp"] = {found.kp - k95 * found.kp_spread, found.kp + k95 * found.kp_spread};
  effect.interval["ki"] = {found.ki - k95 * found.ki_spread, found.ki + k95 * found.ki_spread};
  std::string inlet;
  if (found.filter_s > 0.0) {
    effect.spec.parameters["filter"] = found.filter_s;
    inlet = text(" and a filter of %.3g s on PV", found.filter_s);
  }
  if (found.dead_band > 0.0) {
    effect.spec.parameters["dead_band"] = found.dead_band;
    inlet = text(" and a dead band of the error of %.3g PV units", found.dead_band);
  }
  effect.evidence = text(
      "replayed on the measured SP and PV, the model's controller misses CO by %.3g; "
      "with kp %.4g and ki %.4g (model: %.4g and %.4g)%s by %.2g",
      found.before_rmse, found.kp, found.ki, model.kp, model.ki, inlet.c_str(), found.after_rmse);
  if (!inlet.empty())
    effect.evidence += "; the corrected model takes the gains over, it knows no such part";
  return effect;
}

std::vector<FoundEffect> describe_reading(const ReadingFinding& reading,
                                          const plant::LoopModel& model) {
  std::vector<FoundEffect> out;
  const auto add = [&](effects::EffectSpec spec, std::string evidence) {
    const bool known =
        std::any_of(model.transmitter_effects.begin(), model.transmitter_effects.end(),
                    [&](const effects::EffectSpec& s) { return s.name == spec.name; });
    if (known) return;
    FoundEffect effect;
    effect.spec = std::move(spec);
    effect.block = effects::Block::transmitter;
    effect.confidence = kReadingConfidence;
    effect.evidence = std::move(evidence);
    out.push_back(std::move(effect));
  };
  if (reading.held) {
    const double interval_s = reading.held->interval_samples * model.sample_time_s;
    effects::EffectSpec spec{"held_measurement", {{"interval", interval_s}}};
    const double first_s = reading.held->first_sample * model.sample_time_s;
    if (first_s > 0.0) spec.parameters["first"] = first_s;
    add(std::move(spec), text("PV takes a new value once in %.4g s, %zu times, and is exactly flat "
                              "in between",
                              interval_s, reading.held->renewals));
  }
  const plant::TransmitterParameters& range = model.transmitter;
  const double margin = kSameEnd * range.span();
  effects::EffectSpec ends{"clipped_measurement"};
  std::string where;
  const auto add_end = [&](const char* key, const std::optional<double>& end, double own,
                           std::size_t samples) {
    if (!end || std::abs(*end - own) <= margin) return;
    ends.parameters[key] = *end;
    where += (where.empty() ? "" : " and ") +
             text("at %.4g, exactly flat, for %zu samples", *end, samples);
  };
  add_end("low", reading.low, range.low, reading.at_low);
  add_end("high", reading.high, range.high, reading.at_high);
  if (reading.spikes.count >= kFewestSpikes) {
    const double share =
        static_cast<double>(reading.spikes.samples) / static_cast<double>(reading.spikes.at.size());
    add({"spikes", {{"share", share}, {"size", reading.spikes.size}}},
        text("PV leaves its course within one sample and is back within one, %zu times, as no "
             "process does: "
             "these samples are skipped",
             reading.spikes.count));
  }
  if (!where.empty()) {
    add(std::move(ends), text("PV stands %s; the transmitter's range is %.4g to %.4g",
                              where.c_str(), range.low, range.high));
  }
  return out;
}

std::vector<TriedCandidate> describe_tried(const SearchResult& search, const ModelFit& model_fit,
                                           Outcome outcome) {
  std::vector<TriedCandidate> out;
  for (const Hypothesis& h : search.singles) {
    TriedCandidate tried;
    tried.name = h.fit.terms[0]->name;
    tried.block = h.fit.terms[0]->block;
    tried.spec = spec_of(model_fit.run, h.fit, 0);
    tried.rmse = h.training_rmse;
    tried.score = h.score;
    tried.chosen = outcome == Outcome::missing_effect && contains(search.chosen.fit, tried.name);
    if (!tried.chosen) tried.why_not = why_not(h, search, outcome);
    out.push_back(std::move(tried));
  }
  return out;
}

std::string hidden_by_load(const SearchResult& search, const ModelFit& model_fit) {
  std::string out;
  for (const Hypothesis& h : search.singles) {
    const effects::Candidate& term = *h.fit.terms[0];
    const bool slow =
        std::string_view(term.name) == "output_bias" || std::string_view(term.name) == "drift";
    if (!slow || !(model_fit.fitter.load_ratio(h.fit) > 0.0)) continue;
    const effects::EffectSpec spec = spec_of(model_fit.run, h.fit, 0);
    for (const auto& [name, interval] : intervals(h.fit, 0, model_fit.fitter, spec)) {
      out +=
          text("%s %s between %.2g and %.2g %s", out.empty() ? "" : ", or", term.name, interval[0],
               interval[1], effects::find_parameter(*effects::find_effect(term.name), name)->unit);
    }
  }
  return out.empty() ? out : "indistinguishable from the disturbance in this record:" + out;
}

std::string sentence_of(const Summary& r) {
  if (r.outcome == Outcome::no_gap) {
    return text("The model explains the record. The remaining error, %.3g rms, is %s.",
                r.after.rmse,
                r.with_load ? "noise and an unmeasured disturbance" : "the noise of the record");
  }
  if (r.outcome == Outcome::unexplained) {
    std::string out =
        text("Model and record differ by %.3g rms. No effect of the catalogue explains this.",
             r.before.rmse);
    if (!r.best.empty() && r.best_closed > 0.0) {
      std::string names;
      for (const std::string& name : r.best) names += (names.empty() ? "" : " and ") + name;
      out += text(" The best candidate, %s, closes only %.0f %% of the gap on unseen data.",
                  names.c_str(), 100.0 * r.best_closed);
    }
    if (r.remainder && r.remainder->looks_like != LooksLike::nothing_known) {
      out += text(" The error looks like %s.", to_text(r.remainder->looks_like));
    }
    return out;
  }
  if (r.effects.size() == 1 && r.effects[0].spec.options.contains("description")) {
    return text(
        "No effect of the catalogue fits, but the missing law could be learned: %s. Adding it "
        "reduces the error on unseen data from %.3g to %.3g PV units.",
        r.effects[0].spec.options.at("description").c_str(), r.before.holdout_rmse,
        r.after.holdout_rmse);
  }
  std::string names;
  for (std::size_t i = 0; i < r.effects.size(); ++i) {
    names += i == 0 ? "" : i + 1 == r.effects.size() ? " and " : ", ";
    names += r.effects[i].spec.name + " (" + parameters_text(r.effects[i].spec) + ")";
  }
  if (r.plant_unexplained) {
    return text(
        "The model lacks %s, as CO shows. From CO to PV, model and record differ by %.3g rms. No "
        "effect of the catalogue explains this.",
        names.c_str(), r.before.rmse);
  }
  if (r.closed_loop && !(r.after.holdout_rmse < r.before.holdout_rmse)) {
    return text(
        "The model lacks %s. The evidence is from the replayed controller, because a free closed "
        "loop does not keep the phase of a cycle.",
        names.c_str());
  }
  if (std::isfinite(r.until_s)) {
    return text(
        "The model lacks %s until %.4g s. This was checked on stretches left out of the fit. The "
        "later course cannot be predicted.",
        names.c_str(), r.until_s);
  }
  if (!(r.after.holdout_rmse < r.before.holdout_rmse)) {
    return text(
        r.with_load
            ? "The model lacks %s. On the last third the disturbance moves PV by more than "
              "that. From sample to sample the corrected model predicts PV better."
            : "The model lacks %s. The effect is visible in the fitted part, not in the last "
              "third.",
        names.c_str());
  }
  std::string out = text(
      "The model lacks %s. Adding %s reduces the error on unseen data from %.3g to %.3g PV units",
      names.c_str(), r.effects.size() > 1 ? "them" : "it", r.before.holdout_rmse,
      r.after.holdout_rmse);
  if (!r.remainder || !(r.remainder->share >= kWorthSaying)) return out + ".";
  return out + text(" (%.0f %% of the gap). The remaining error looks like %s.",
                    100.0 * (1.0 - r.remainder->share), to_text(r.remainder->looks_like));
}

}  // namespace loopwarden::gap
