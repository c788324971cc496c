// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/hidden_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "lab/hidden_cases/draft.hpp"

namespace loopwarden::hidden_cases {
namespace {

constexpr std::size_t kFewestSamples = 600;
constexpr int kMostAttempts = 30;
// Length of the healthy record at the start of a loop to commission.
constexpr double kCommissioned_s = 1200.0;

const std::vector<std::string> kSingles{"stiction",
                                        "backlash",
                                        "hysteresis",
                                        "low_air_supply",
                                        "valve_characteristic",
                                        "positioner_overshoot",
                                        "gain_change",
                                        "extra_dead_time",
                                        "extra_lag",
                                        "output_bias",
                                        "drift",
                                        "oscillating_disturbance",
                                        "step_disturbance",
                                        "controller_mismatch"};

const std::vector<std::string> kOnsets{"onset:stiction", "onset:backlash", "onset:hysteresis",
                                       "onset:low_air_supply", "onset:none"};

const std::vector<std::string> kLaters{"later:stiction",
                                       "later:backlash",
                                       "later:hysteresis",
                                       "later:low_air_supply",
                                       "later:gain_change",
                                       "later:extra_lag",
                                       "later:extra_dead_time",
                                       "later:drift",
                                       "later:step_disturbance",
                                       "later:output_bias",
                                       "later:controller_mismatch",
                                       "later:positioner_overshoot",
                                       "later:oscillating_disturbance",
                                       "later:stiction+gain_change",
                                       "later:backlash+oscillating_disturbance",
                                       "later:none"};

const std::vector<std::string> kHealthy{"later:none"};

const std::vector<std::string> kControllers{"controller_mismatch"};

const std::vector<std::string> kNones{"none", "none:aggressive_tuning", "none:sluggish_tuning",
                                      "none:constant_set_point"};

// The first two are drawn most often.
const std::vector<std::string> kPairs{"stiction+gain_change",
                                      "backlash+oscillating_disturbance",
                                      "stiction+oscillating_disturbance",
                                      "stiction+step_disturbance",
                                      "stiction+extra_dead_time",
                                      "stiction+output_bias",
                                      "stiction+drift",
                                      "backlash+gain_change",
                                      "backlash+step_disturbance",
                                      "backlash+extra_dead_time",
                                      "backlash+output_bias",
                                      "backlash+drift",
                                      "hysteresis+gain_change",
                                      "hysteresis+oscillating_disturbance",
                                      "hysteresis+step_disturbance",
                                      "hysteresis+drift",
                                      "low_air_supply+gain_change",
                                      "low_air_supply+oscillating_disturbance",
                                      "low_air_supply+step_disturbance",
                                      "low_air_supply+output_bias",
                                      "valve_characteristic+oscillating_disturbance",
                                      "valve_characteristic+step_disturbance",
                                      "valve_characteristic+extra_dead_time",
                                      "positioner_overshoot+gain_change",
                                      "positioner_overshoot+oscillating_disturbance",
                                      "positioner_overshoot+step_disturbance",
                                      "positioner_overshoot+output_bias"};

const std::vector<std::string> kOutside{"outside:inverse_response",
                                        "outside:underdamped_process",
                                        "outside:pv_spikes",
                                        "outside:intermittent_sticking",
                                        "outside:stuck_stretches",
                                        "outside:leakage",
                                        "outside:wandering_gain",
                                        "outside:square_disturbance",
                                        "outside:telegraph_disturbance",
                                        "outside:chirp_disturbance",
                                        "outside:two_way_time_constant",
                                        "outside:dead_time_with_flow",
                                        "outside:saturating_transmitter",
                                        "outside:staircase_positioner",
                                        "outside:recycle",
                                        "outside:slow_tail"};

const std::vector<std::string> kFurthers{
    "resolution",          "inverse_response", "ramp_disturbance",         "square_disturbance",
    "oscillatory_process", "varying_gain",     "intermittent_stiction",    "clipped_measurement",
    "held_measurement",    "stiction:closing", "flow_dependent_dead_time", "plugging",
    "meter_curve"};

bool is_later(Kind kind) { return kind == Kind::kLater || kind == Kind::kHealthy; }

// "onset:stiction" -> "stiction"
std::string onset_effect(const CaseRequest& request) {
  return request.effect.substr(request.effect.find(':') + 1);
}

std::vector<std::string> parts_of(const CaseRequest& request) {
  const bool begins = request.kind == Kind::kOnset || is_later(request.kind);
  const std::string effect = begins ? onset_effect(request) : request.effect;
  const std::size_t plus = effect.find('+');
  if (plus == std::string::npos) return {effect};
  return {effect.substr(0, plus), effect.substr(plus + 1)};
}

// Effects that were added to the catalogue later.
std::vector<std::string> names_outside(const std::string& effect) {
  static const std::map<std::string, std::string> kNow{
      {"outside:inverse_response", "inverse_response"},
      {"outside:underdamped_process", "oscillatory_process"},
      {"outside:intermittent_sticking", "intermittent_stiction"},
      {"outside:leakage", "leakage"},
      {"outside:wandering_gain", "varying_gain"},
      {"outside:square_disturbance", "square_disturbance"},
      {"outside:dead_time_with_flow", "flow_dependent_dead_time"},
      {"outside:saturating_transmitter", "clipped_measurement"},
      {"outside:pv_spikes", "spikes"},
      {"outside:recycle", "recycle"},
      {"outside:staircase_positioner", "resolution"}};
  const auto now = kNow.find(effect);
  if (now == kNow.end()) return {"unexplained"};
  return {"unexplained", now->second};
}

std::vector<std::string> accepted_names(const CaseRequest& request) {
  if (request.kind == Kind::kNone) return {"none"};
  if (request.kind == Kind::kOutside) return names_outside(request.effect);
  // Distributed play and single play can't always be distinguished.
  if (parts_of(request) == std::vector<std::string>{"hysteresis"}) {
    return {"hysteresis", "backlash"};
  }
  if (request.effect == "stiction:closing") return {"stiction"};
  return parts_of(request);
}

void append(Chain& chain, Chain more) {
  std::move(more.begin(), more.end(), std::back_inserter(chain));
}

// Appends parts that begin at `from_s`.
void append_from(Chain& path, Chain more, double from_s) {
  if (from_s <= 0.0) return append(path, std::move(more));
  if (!more.empty()) path.push_back(make_onset({}, std::move(more), from_s));
}

void append_process(Chain& path, Draft& draft) {
  const Plant plant = draft.plant;
  if (draft.transport) {
    path.push_back(std::move(draft.transport));
  } else {
    const bool later = draft.from_s > 0.0 && draft.extra_dead_time_s > 0.0;
    path.push_back(make_dead_time(plant.dead_time_s + (later ? 0.0 : draft.extra_dead_time_s)));
    if (later) {
      Chain extra;
      extra.push_back(make_dead_time(draft.extra_dead_time_s));
      append_from(path, std::move(extra), draft.from_s);
    }
  }
  if (draft.gain_factor) {
    path.push_back(
        make_gain([gain = plant.gain, factor = draft.gain_factor, from_s = draft.from_s](double t) {
          return from_s > 0.0 && t < from_s ? gain : gain * factor(t);
        }));
  } else {
    path.push_back(make_gain([gain = plant.gain](double) { return gain; }));
  }
  path.push_back(draft.core ? std::move(draft.core) : make_lag(plant.time_constant_s));
  if (plant.second_lag_s > 0.0) path.push_back(make_lag(plant.second_lag_s));
  append_from(path, std::move(draft.after_process), draft.from_s);
}

TruthLoop build(Draft draft, Tuning believed, const SetPointProfile& profile) {
  TruthLoop loop;
  loop.path.push_back(make_lag(draft.plant.actuator_lag_s));
  Chain valve;
  append(valve, std::move(draft.before_stem));
  valve.push_back(draft.stem ? std::move(draft.stem) : make_karnopp_stem(draft.plant.stem));
  append(valve, std::move(draft.after_stem));
  if (draft.from_s > 0.0) {
    Chain healthy;
    healthy.push_back(make_karnopp_stem(draft.plant.stem));
    loop.path.push_back(make_onset(std::move(healthy), std::move(valve), draft.from_s));
  } else {
    append(loop.path, std::move(valve));
  }
  append(loop.path, std::move(draft.characteristic));
  append_process(loop.path, draft);
  for (auto& signal : draft.added) {
    loop.added.emplace_back([signal = std::move(signal), from_s = draft.from_s](double t) {
      if (from_s <= 0.0) return signal(t);
      return t < from_s ? 0.0 : signal(t - from_s);
    });
  }
  loop.line_lag_s = draft.line_lag_s;
  loop.meter = draft.meter;
  loop.reading_stands = draft.reading_stands;
  const Tuning real{believed.kp * draft.kp_factor, believed.ki_per_s * draft.ki_factor};
  if (draft.from_s > 0.0) {
    loop.tuning = believed;
    loop.retuned = {draft.from_s, real};
  } else {
    loop.tuning = real;
  }
  if (draft.transmitter_short_of_top > 0.0) {
    const auto top = std::max_element(profile.begin(), profile.end(),
                                      [](auto& a, auto& b) { return a.second < b.second; });
    loop.transmitter_top = top->second - draft.transmitter_short_of_top;
  }
  return loop;
}

// Returns whether operators would leave the loop in automatic: it must not run against its stops or
// grow.
bool is_plausible(const LoopRecord& record, double most_time_at_stops, double most_tail_error) {
  const std::size_t count = record.pv.size() - record.first;
  std::size_t at_stops = 0;
  double tail_error = 0.0;
  for (std::size_t k = record.first; k < record.pv.size(); ++k) {
    if (record.co[k] <= 0.0 || record.co[k] >= 10.0) ++at_stops;
    if (k >= record.pv.size() - count / 3) {
      const double error = record.sp[k] - record.pv[k];
      tail_error += error * error;
    }
  }
  const double rms = std::sqrt(3.0 * tail_error / static_cast<double>(count));
  const double share = static_cast<double>(at_stops) / static_cast<double>(count);
  return share <= most_time_at_stops && rms <= most_tail_error;
}

// Returns rough values, as remembered for a loop that was never identified.
BelievedLoop rough_belief(const Plant& plant, Tuning tuning, Random& random) {
  return {tuning, plant.gain * random.uniform(0.7, 1.3),
          plant.time_constant_s * random.uniform(0.7, 1.3),
          plant.dead_time_s * random.uniform(0.6, 1.4)};
}

BelievedLoop believed_loop(const Plant& plant, Tuning tuning, Random& random) {
  const double seen_as_dead_time_s =
      plant.dead_time_s + plant.second_lag_s + plant.actuator_lag_s + plant.stem.damping_s;
  return {tuning, plant.gain * random.uniform(0.98, 1.02),
          plant.time_constant_s * random.uniform(0.96, 1.04),
          seen_as_dead_time_s * random.uniform(0.98, 1.02)};
}

// A limit cycle is slow, so sticky loops are recorded for longer.
std::size_t samples_of(const CaseRequest& request, Random& random) {
  const bool sticky = request.kind != Kind::kOutside && request.effect.rfind("stiction", 0) == 0;
  return sticky && random.chance(0.8) ? request.samples * 10 / 7 : request.samples;
}

// Cuts the record after `count` rows. Returns the other rows.
LoopRecord cut(LoopRecord& record, std::size_t count) {
  LoopRecord rest;
  const auto move = [&](std::vector<double>& from, std::vector<double>& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(count), from.end());
    from.resize(count);
  };
  move(record.time_s, rest.time_s);
  move(record.sp, rest.sp);
  move(record.pv, rest.pv);
  move(record.co, rest.co);
  move(record.truth_pv, rest.truth_pv);
  return rest;
}

HiddenCase attempt(const CaseRequest& request, Random& random, bool& plausible) {
  HiddenCase one;
  one.id = request.id;
  one.effect = request.kind == Kind::kNone ? "none" : request.effect;
  const bool later = is_later(request.kind);
  if (request.kind == Kind::kOnset || later) one.effect = onset_effect(request);
  one.accept = accepted_names(request);

  const std::size_t samples = samples_of(request, random);
  Draft draft;
  draft.plant = later ? draw_common_plant(random) : draw_plant(random);
  draft.duration_s = kPeriod_s * static_cast<double>(samples);
  if (later && random.chance(1.0 / 3.0)) {
    apply_effect("valve_characteristic", draft, random);
    draft.characteristic = std::exchange(draft.after_stem, {});
  }
  for (const std::string& part : parts_of(request)) apply_effect(part, draft, random);
  if (request.kind == Kind::kOnset) one.from_s = draft.duration_s * random.uniform(0.4, 0.6);
  if (request.kind == Kind::kLater && one.effect != "none") {
    one.from_s = kCommissioned_s + 0.5 * (draft.duration_s - kCommissioned_s);
    // The step is at the onset itself, because the drawn one is at another time.
    if (one.effect == "step_disturbance") {
      draft.added = {[size = draft.parameters.at("size")](double) { return size; }};
    }
  }
  draft.from_s = one.from_s;
  const Tuning tuning = draw_tuning(draft, random);
  const SetPointProfile profile =
      !later ? draw_profile(draft, random)
             : draw_operated_profile(draft, request.kind == Kind::kHealthy, random);
  one.believed = later ? rough_belief(draft.plant, tuning, random)
                       : believed_loop(draft.plant, tuning, random);
  one.parameters = draft.parameters;
  one.note = draft.note;
  const double most_time_at_stops = draft.most_time_at_stops;
  const double most_tail_error = draft.most_tail_error;
  if (one.effect == "controller_mismatch") {
    one.parameters = {{"kp", tuning.kp * draft.kp_factor},
                      {"ki", tuning.ki_per_s * draft.ki_factor}};
  }

  TruthLoop loop = build(std::move(draft), tuning, profile);
  loop.noise_rms = random.uniform(0.009, 0.03);
  loop.load_per_root_s = request.load ? 0.01 : 0.0;
  if (request.kind == Kind::kHealthy) {
    loop.load_later = {kCommissioned_s, loop.load_per_root_s * random.uniform(1.0, 3.0)};
  }
  // Most records begin at rest, some during normal movement of the loop.
  const std::size_t before = random.chance(0.25) ? 300 + random.index(900) : 0;
  one.record = run(loop, profile, samples, before, random, request.test);
  one.test = cut(one.record, before + samples);
  one.floor_rmse = floor_rmse(one.record);
  plausible = is_plausible(one.record, most_time_at_stops, most_tail_error);
  return one;
}

std::size_t share_of(Kind kind) {
  switch (kind) {
    case Kind::kSingle: return 30;
    case Kind::kNone: return 4;
    case Kind::kPair: return 6;
    case Kind::kOutside: return 6;
    case Kind::kOnset: return 30;
    case Kind::kController: return 6;
    case Kind::kFurther:
    case Kind::kLater:
    case Kind::kHealthy: return 30;
  }
  return 0;
}

// Returns the number of cases of each kind: in proportion, with the remainder for the first kinds.
std::vector<std::size_t> split(std::size_t count, const std::vector<Kind>& kinds) {
  std::size_t shares = 0;
  for (const Kind kind : kinds) shares += share_of(kind);
  std::vector<std::size_t> counts;
  std::size_t given = 0;
  for (const Kind kind : kinds) {
    counts.push_back(count * share_of(kind) / shares);
    given += counts.back();
  }
  for (std::size_t i = 0; given < count; i = (i + 1) % counts.size(), ++given) ++counts[i];
  return counts;
}

std::vector<std::string> shuffled(std::vector<std::string> names, Random& random) {
  for (std::size_t i = names.size(); i > 1; --i) std::swap(names[i - 1], names[random.index(i)]);
  return names;
}

std::vector<std::string> draw_effects(Kind kind, std::size_t count, Random& random) {
  std::vector<std::string> drawn;
  if (kind == Kind::kPair) {
    const std::vector<std::string> rest = shuffled({kPairs.begin() + 2, kPairs.end()}, random);
    for (std::size_t k = 0; k < count; ++k) {
      drawn.push_back(k % 2 == 0 ? kPairs[k / 2 % 2] : rest[k / 2 % rest.size()]);
    }
    return drawn;
  }
  const std::vector<std::string> names = shuffled(effect_names(kind), random);
  for (std::size_t k = 0; k < count; ++k) drawn.push_back(names[k % names.size()]);
  return drawn;
}

}  // namespace

const std::vector<std::string>& effect_names(Kind kind) {
  switch (kind) {
    case Kind::kSingle: return kSingles;
    case Kind::kNone: return kNones;
    case Kind::kPair: return kPairs;
    case Kind::kOutside: return kOutside;
    case Kind::kOnset: return kOnsets;
    case Kind::kController: return kControllers;
    case Kind::kFurther: return kFurthers;
    case Kind::kLater: return kLaters;
    case Kind::kHealthy: return kHealthy;
  }
  throw std::invalid_argument("no such kind of hidden case");
}

HiddenCase make_case(const CaseRequest& request) {
  const std::vector<std::string>& known = effect_names(request.kind);
  if (std::find(known.begin(), known.end(), request.effect) == known.end()) {
    throw std::invalid_argument(fmt::format("no hidden effect is called '{}'", request.effect));
  }
  if (request.samples < kFewestSamples) {
    throw std::invalid_argument(fmt::format("a case needs {} samples or more", kFewestSamples));
  }
  HiddenCase one;
  bool plausible = false;
  for (int i = 0; i < kMostAttempts && !plausible; ++i) {
    // Makes the streams of neighbouring seeds and attempts independent.
    Random scramble(request.seed * 64U + static_cast<std::uint64_t>(i));
    Random random(scramble.bits());
    one = attempt(request, random, plausible);
  }
  return one;
}

std::vector<CaseRequest> plan_cases(std::size_t count, std::uint64_t seed,
                                    const std::vector<Kind>& kinds, bool load,
                                    std::size_t samples) {
  std::vector<CaseRequest> requests;
  const std::vector<std::size_t> counts = split(count, kinds);
  Random random(seed);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (const std::string& effect : draw_effects(kinds[k], counts[k], random)) {
      const std::uint64_t case_seed = seed + requests.size();
      requests.push_back({fmt::format("{}{}", load ? "l" : "h", case_seed), kinds[k], effect,
                          case_seed, load, samples});
    }
  }
  return requests;
}

}  // namespace loopwarden::hidden_cases
