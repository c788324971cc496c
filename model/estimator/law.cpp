// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/law.hpp"

#include <algorithm>
#include <string_view>

namespace loopwarden::estimator {
namespace {

using effects::Block;

constexpr double kRarer = 2.0;       // nats: a law at another place or time against one with a name
constexpr double kLeastRatio = 0.1;  // j over s of stiction

bool has_unit(const Candidate& candidate, std::string_view parameter, std::string_view unit) {
  const effects::Descriptor* info = effects::find_effect(candidate.name);
  if (info == nullptr) return false;
  return std::any_of(info->parameters.begin(), info->parameters.end(),
                     [&](const effects::ParameterInfo& p) {
                       return p.name == parameter && std::string_view(p.unit).starts_with(unit);
                     });
}

// Sizes in CO units become sizes in PV units.
Law in_transmitter(Law law, double pv_over_co) {
  law.block = Block::transmitter;
  law.named = false;
  law.prior_nats += kRarer;
  law.with_momentum = nullptr;
  law.slips = false;
  law.friction = false;
  for (effects::SearchRange& range : law.search) {
    if (!has_unit(law, range.name, "CO units")) continue;
    range.low *= pv_over_co;
    range.high *= pv_over_co;
  }
  return law;
}

Law at_times(Law law, Law::Timing timing) {
  law.timing = timing;
  law.named = false;
  law.slips = false;
  law.prior_nats += kRarer;
  law.smooth = law.smooth && timing != Law::Timing::since;
  if (timing == Law::Timing::since) {
    law.parameters += 2;  // a moment counts as two (Zhang and Siegmund 2007)
    law.at_one_moment = true;
  }
  return law;
}

}  // namespace

Law law_of(const Candidate& candidate, double duration_s) {
  Law law;
  static_cast<Candidate&>(law) = candidate;
  law.duration_s = duration_s;
  law.moment = {"from", 0.05 * duration_s, 0.95 * duration_s, false, 12, 0.04};
  // Stiction without a jump is backlash.
  if (law.slips) law.search[1].low = kLeastRatio;
  return law;
}

Law stepped_gain(Law law) {
  law.solves_gain = false;
  law.solved.clear();
  law.search = {{"factor", 0.4, 2.5, true, 8}};
  return law;
}

effects::Schedule Law::schedule(double moment_s) const noexcept {
  if (timing == Timing::since) return {.from_s = moment_s};
  if (timing == Timing::growing) return {.from_s = 0.0, .ramp_s = duration_s};
  return {};
}

std::string Law::description() const {
  std::string text = name;
  std::replace(text.begin(), text.end(), '_', ' ');
  const effects::Descriptor* info = effects::find_effect(name);
  if (info != nullptr && block != info->blocks.front()) {
    text += std::string(" in the ") + to_text(block);
  }
  if (timing == Timing::growing) text += " that grows in time";
  if (timing == Timing::since) text += " since a moment";
  return text;
}

std::vector<Law> named_laws(const std::vector<Candidate>& catalogue, double duration_s) {
  std::vector<Law> laws;
  for (const Candidate& candidate : catalogue) laws.push_back(law_of(candidate, duration_s));
  return laws;
}

std::vector<Law> unnamed_laws(const std::vector<Candidate>& catalogue, double duration_s,
                              double pv_over_co) {
  std::vector<Law> laws;
  std::vector<std::string_view> seen;
  for (const Candidate& candidate : catalogue) {
    const std::string_view name = candidate.name;
    if (std::find(seen.begin(), seen.end(), name) != seen.end()) continue;
    seen.push_back(name);
    const Law law = law_of(candidate, duration_s);
    if (name == "backlash" || name == "hysteresis" || name == "stiction" || name == "resolution") {
      laws.push_back(in_transmitter(law, pv_over_co));
    }
    if (name == "backlash" || name == "stiction" || name == "extra_lag" ||
        name == "extra_dead_time" || name == "valve_characteristic") {
      laws.push_back(at_times(law, Law::Timing::growing));
    }
    if (name == "backlash" || name == "hysteresis" || name == "extra_lag" ||
        name == "extra_dead_time" || name == "valve_characteristic" || name == "low_air_supply" ||
        name == "positioner_overshoot" || name == "inverse_response") {
      laws.push_back(at_times(law, Law::Timing::since));
    }
    if (name == "gain_change") {
      laws.push_back(at_times(stepped_gain(law), Law::Timing::since));
    }
  }
  return laws;
}

}  // namespace loopwarden::estimator
