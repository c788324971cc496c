// SPDX-License-Identifier: Apache-2.0
#include "model/gap/archived.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "model/gap/say.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::gap {
namespace {

using numeric::text;

constexpr double kWithin = 1.5;     // floors
constexpr double kCounts = 0.7;     // of c, that an effect must bring
constexpr double kAlike = 0.3;      // of c, below which two names are one
constexpr double kNearlyAll = 3.0;  // floors: a misfit below may be the archive's
constexpr double kMostConfidence = 0.85;
constexpr int kMostSearches = 3;
constexpr const char* kController = "controller_mismatch";

double gain_of(const plant::LoopModel& model) {
  return model.process.integrating() ? 0.0 : std::abs(model.process.gain);
}

// Widest of the parameters that are a band in CO units; 0: the effect has none.
double band_of(const effects::EffectSpec& spec) {
  constexpr std::array<std::string_view, 8> kBands{"s",    "deadband", "width",     "offset",
                                                   "step", "jump",     "s_closing", "band"};
  double widest = 0.0;
  for (const auto& [name, value] : spec.parameters) {
    if (std::find(kBands.begin(), kBands.end(), name) != kBands.end())
      widest = std::max(widest, std::abs(value));
  }
  return widest;
}

// What the archive does to any signal by itself.
bool of_the_archive(const std::string& name) {
  return name == "held_measurement" || name == "clipped_measurement" || name == "resolution";
}

// What the misfit loses by the effect, PV units; NaN where the steps don't tell.
double brings(const Result& result, const std::string& name) {
  double before = result.before.training_rmse;
  for (const Step& step : result.steps) {
    if (step.change == Step::Change::added && step.effect == name) {
      return std::sqrt(std::max(0.0, before * before - step.rmse * step.rmse));
    }
    before = step.rmse;
  }
  return kNone;
}

// Of what leaves no more than the named effect does, within what the archive hides, the one with
// the fewest parameters; null: the named one is it.
const TriedCandidate* simpler_than_named(const Result& result, double hidden) {
  if (result.effects.size() != 1) return nullptr;
  const auto named = std::find_if(
      result.candidates.begin(), result.candidates.end(),
      [&](const TriedCandidate& c) { return c.name == result.effects.front().spec.name; });
  if (named == result.candidates.end()) return nullptr;
  const TriedCandidate* simplest = &*named;
  for (const TriedCandidate& c : result.candidates) {
    const double more = c.rmse * c.rmse - named->rmse * named->rmse;
    if (!(more < hidden * hidden) || of_the_archive(c.name) || c.name == kController) continue;
    if (c.spec.parameters.size() < simplest->spec.parameters.size()) simplest = &c;
  }
  return simplest == &*named ? nullptr : simplest;
}

void say_so(Result& result, Outcome outcome, const plant::LoopModel& model) {
  result.outcome = outcome;
  result.effects.clear();
  result.steps.clear();
  result.after = result.before;
  result.corrected = model;
  result.series.pv_after = result.series.pv_before;
  result.series.co_after = result.series.co_before;
  result.controller_after_rmse = result.controller_before_rmse;
  result.remainder.reset();
}

}  // namespace

double sees_from(const plant::LoopModel& model, const Deviations& deviations) {
  const double gain = gain_of(model);
  return 2.0 * std::max(deviations.co, gain > 0.0 ? deviations.pv / gain : 0.0);
}

Result find_gap_archived(const LoopRecord& record, const plant::LoopModel& model,
                         const Options& options, const Deviations& deviations,
                         const ParallelFor& parallel, const std::function<void(double)>& progress) {
  const double narrowest = sees_from(model, deviations);
  const double kept_from =
      std::hypot(deviations.pv, gain_of(model) * deviations.co) / std::sqrt(3.0);
  const double counts = kCounts * kept_from;
  Options now = options;
  now.search.several = false;
  Result result;
  Floor floor;
  double floor_rmse = 0.0;
  bool dropped = false;
  std::string alike;  // named before, and no better within what the archive hides
  for (int search = 0; search < kMostSearches; ++search) {
    result = find_gap(record, model, now, parallel, [&](double share) {
      progress((static_cast<double>(search) + share) / static_cast<double>(kMostSearches));
    });
    if (!result.check.usable) return result;
    if (search == 0) {
      floor = result.floor;
      floor.transmitter_rmse = std::hypot(floor.transmitter_rmse, kept_from);
      floor.load_rmse =
          std::sqrt(std::max(0.0, floor.load_rmse * floor.load_rmse - kept_from * kept_from));
      floor_rmse = floor.rmse();
    }
    if (result.before.rmse <= kWithin * floor_rmse &&
        result.before.holdout_rmse <= kWithin * floor_rmse) {
      say_so(result, Outcome::no_gap, model);
      break;
    }
    if (result.outcome != Outcome::missing_effect) break;
    if (!deviations.known) {
      dropped = true;
      say_so(result, Outcome::unexplained, model);
      break;
    }
    const auto doubtful = [&](const FoundEffect& effect) {
      const double band = band_of(effect.spec);
      const bool too_narrow =
          effect.block == effects::Block::valve && band > 0.0 && band < narrowest;
      return effect.spec.name != kController && (of_the_archive(effect.spec.name) || too_narrow ||
                                                 brings(result, effect.spec.name) < counts);
    };
    bool search_can = false;
    bool controller = false;
    for (const FoundEffect& effect : result.effects) {
      // The controller's settings are told beside the search, not by it.
      controller = controller || effect.spec.name == kController;
      if (!doubtful(effect)) continue;
      now.search.without.push_back(effect.spec.name);
      search_can = true;
    }
    const TriedCandidate* simpler = simpler_than_named(result, kAlike * kept_from);
    if (simpler != nullptr && !search_can && !controller) {
      Options without = now;
      without.search.without.push_back(result.effects.front().spec.name);
      Result again = find_gap(record, model, without, parallel, [](double) {});
      // What fits as well must hold as well.
      if (again.effects.size() == 1 && again.effects.front().spec.name == simpler->name) {
        alike = result.effects.front().spec.name;
        result = std::move(again);
      }
    }
    if (!search_can && !controller) break;
    dropped = true;
    if (search_can && search + 1 < kMostSearches) continue;
    // What else was found was fitted beside them.
    if (search_can) {
      say_so(result, Outcome::unexplained, model);
      break;
    }
    std::erase_if(result.effects, [](const FoundEffect& e) { return e.spec.name == kController; });
    result.corrected.controller = model.controller;
    result.controller_after_rmse = result.controller_before_rmse;
    result.series.co_after = result.series.co_before;
    if (result.effects.empty()) say_so(result, Outcome::unexplained, model);
    break;
  }
  progress(1.0);
  result.floor = floor;
  for (FoundEffect& effect : result.effects) {
    effect.confidence = std::min(effect.confidence, kMostConfidence);
    if (alike.empty()) continue;
    effect.alternatives.push_back(alike);
    effect.evidence += text("; within what the archive hides %s fits as well, with more parameters",
                            alike.c_str());
  }
  if (result.outcome == Outcome::unexplained &&
      (dropped || result.before.holdout_rmse < kNearlyAll * floor_rmse)) {
    result.remainder = Remainder{.rmse = result.after.holdout_rmse,
                                 .share = result.remainder ? result.remainder->share : 1.0,
                                 .looks_like = LooksLike::compression};
  }
  result.check.notes.push_back(
      {"compressed",
       deviations.known && narrowest == 0.0
           ? std::string(
                 "An archive kept only a part of the samples, by a rule that can't be told: "
                 "PV is compared where a value was stored, CO is taken as held in between.")
       : deviations.known
           ? text("An archive kept PV to about %.2g and CO to about %.2g of their units: "
                  "what is narrower than %.2g CO units "
                  "can't be seen in this record.",
                  deviations.pv, deviations.co, narrowest)
           : std::string("An archive kept only a part of the samples, by a rule that can't be "
                         "told: no effect can be named from this record.")});
  result.sentence = sentence_of({.outcome = result.outcome,
                                 .effects = result.effects,
                                 .before = result.before,
                                 .after = result.after,
                                 .remainder = result.remainder,
                                 .best = {},
                                 .best_closed = 0.0,
                                 .closed_loop = result.closed_loop,
                                 .with_load = result.load_intensity > 0.0});
  if (result.outcome == Outcome::unexplained && result.remainder) {
    result.sentence += " What the archive left out hides the rest.";
  }
  return result;
}

}  // namespace loopwarden::gap
