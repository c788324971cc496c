// SPDX-License-Identifier: Apache-2.0
#include "model/gap/say.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/gap/constants.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::gap {

using numeric::text;

std::string parameters_text(const effects::EffectSpec& spec) {
  std::string out;
  const effects::Descriptor* info = effects::find_word(spec.name);
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

const char* how_likely_without(double nats) {
  return nats < kTooClose      ? "hardly less likely"
         : nats < kFurtherGain ? "less likely"
                               : "far less likely";
}

double rms_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept {
  if (!(before_rmse > floor_rmse)) return kNone;
  return std::clamp((before_rmse - after_rmse) / (before_rmse - floor_rmse), -1.0, 1.0);
}

FoundEffect describe_controller(const ControllerFinding& found, const control::PidGains& model) {
  FoundEffect effect;
  effect.spec = {"controller_mismatch", {{"kp", found.kp}, {"ki", found.ki}}};
  effect.block = effects::Block::controller;
  effect.confidence = kControllerConfidence;
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
    add(std::move(ends), text("PV is %s; the transmitter's range is %.4g to %.4g", where.c_str(),
                              range.low, range.high));
  }
  return out;
}

namespace {

std::string list_of(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    out += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  }
  return out;
}

std::string unexplained_sentence(const Summary& r) {
  std::string out =
      text("Model and record differ by %.3g rms. No effect of the catalogue explains this.",
           r.before.rmse);
  if (!r.best.empty()) {
    out += " The best candidate, " + list_of(r.best) + ", does not hold on unseen data.";
  }
  if (r.remainder && r.remainder->looks_like != LooksLike::nothing_known) {
    out += text(" The error looks like %s.", to_text(r.remainder->looks_like));
  }
  return out;
}

}  // namespace

std::string sentence_of(const Summary& r) {
  if (r.outcome == Outcome::no_gap) {
    return text("The model explains the record. The remaining error, %.3g rms, is %s.",
                r.after.rmse,
                r.with_load ? "noise and an unmeasured disturbance" : "the noise of the record");
  }
  if (r.outcome == Outcome::unexplained) return unexplained_sentence(r);
  if (r.effects.size() == 1 && r.effects[0].spec.options.contains("description")) {
    return text(
        "No effect of the catalogue fits, but a law at another place or time does: %s. Adding it "
        "reduces the error on unseen data from %.3g to %.3g PV units.",
        r.effects[0].spec.options.at("description").c_str(), r.before.holdout_rmse,
        r.after.holdout_rmse);
  }
  std::vector<std::string> parts;
  for (const FoundEffect& effect : r.effects) {
    const std::string parameters = parameters_text(effect.spec);
    parts.push_back(effect.spec.name + (parameters.empty() ? "" : " (" + parameters + ")"));
  }
  const std::string names = list_of(parts);
  if (r.plant_unexplained) {
    return "The model lacks " + names +
           text(
               ". From CO to PV, model and record differ by %.3g rms. No effect of the catalogue "
               "explains this.",
               r.before.rmse);
  }
  if (r.closed_loop && !(r.after.holdout_rmse < r.before.holdout_rmse)) {
    return "The model lacks " + names +
           ". The evidence is from the replayed controller, because a free closed loop does not "
           "keep the phase of a cycle.";
  }
  if (!(r.after.holdout_rmse < r.before.holdout_rmse)) {
    return "The model lacks " + names + ". The error on unseen data is as small without it.";
  }
  std::string out =
      "The model lacks " + names +
      text(". Adding %s reduces the error on unseen data from %.3g to %.3g PV units",
           r.effects.size() > 1 ? "them" : "it", r.before.holdout_rmse, r.after.holdout_rmse);
  const double closed = rms_closed(r.before.holdout_rmse, r.after.holdout_rmse, r.floor);
  if (!r.remainder || !(r.remainder->share >= kWorthSaying) || !std::isfinite(closed)) {
    return out + ".";
  }
  return out +
         text(", which closes %.0f %% of the RMS error above the noise floor.", 100.0 * closed);
}

}  // namespace loopwarden::gap
