// SPDX-License-Identifier: Apache-2.0
#include "model/twin/planned_moves_of.hpp"

#include <algorithm>

namespace loopwarden::twin {
namespace {

double value_of(const std::map<std::string, double>& parameters, const char* name) {
  const auto found = parameters.find(name);
  return found == parameters.end() ? 0.0 : found->second;
}

}  // namespace

std::optional<Stick> stick_of(const std::map<std::string, double>& parameters,
                              const std::map<std::string, std::array<double, 2>>& interval,
                              double confidence, const std::vector<std::string>& alternatives) {
  Stick stick{.s = value_of(parameters, "s"), .j = value_of(parameters, "j")};
  if (!(stick.s > 0.0) || !(stick.j > 0.0)) return std::nullopt;
  const bool play = std::any_of(
      alternatives.begin(), alternatives.end(),
      [](const std::string& name) { return name == "backlash" || name == "hysteresis"; });
  if (play) return std::nullopt;
  stick.confidence = confidence;
  stick.j = std::min(stick.j, stick.s);
  if (const auto s = interval.find("s"); s != interval.end()) stick.s_interval = s->second;
  if (const auto j = interval.find("j"); j != interval.end()) stick.j_interval = j->second;
  return stick;
}

std::optional<control::PlannedMovesSettings> planned_moves_of(const plant::LoopModel& twin) {
  const plant::ProcessParameters& process = twin.process;
  if (process.integrating() || process.gain == 0.0) return std::nullopt;
  const double half_s = 0.5 * process.second_time_constant_s;
  control::PlannedMovesSettings settings{.gain = process.gain,
                                         .time_constant_s = process.time_constant_s + half_s,
                                         .dead_time_s = process.dead_time_s + half_s};
  for (const effects::EffectSpec& one : twin.disturbances) {
    if (one.name == "random_load") settings.load = value_of(one.parameters, "intensity");
  }
  return settings;
}

void set_stick(control::PlannedMovesSettings& settings, const Stick& stick) noexcept {
  settings.s = stick.s;
  settings.j = stick.j;
  settings.s_low = stick.s_interval[0];
  settings.s_high = stick.s_interval[1];
  settings.j_low = stick.j_interval[0];
  settings.j_high = stick.j_interval[1];
}

bool known_well(const Stick& stick) noexcept {
  return control::within_factor_two(stick.s_interval[0], stick.s_interval[1]) &&
         stick.confidence >= kLeastConfidence;
}

}  // namespace loopwarden::twin
