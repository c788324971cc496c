// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "lab/hidden_cases/draft.hpp"

namespace loopwarden::hidden_cases {
namespace {

struct Process {
  double gain;
  double time_constant_s;
  double dead_time_s;
};

// A fast laboratory flow loop, a slow one and a medium one; the others are drawn freely.
constexpr std::array<Process, 3> kKnownProcesses{
    {{1.2264, 1.69376, 2.6256}, {1.1, 8.0, 2.0}, {0.9, 4.0, 1.2}}};

Process draw_process(Random& random) {
  if (random.chance(0.6)) {
    const Process known = kKnownProcesses[random.index(kKnownProcesses.size())];
    return {known.gain * random.uniform(0.92, 1.08),
            known.time_constant_s * random.uniform(0.88, 1.12),
            known.dead_time_s * random.uniform(0.88, 1.12)};
  }
  const double time_constant_s = random.log_uniform(1.5, 11.0);
  const double dead_time_s = std::clamp(time_constant_s * random.log_uniform(0.2, 1.5), 0.8, 4.0);
  return {random.log_uniform(0.85, 1.5), time_constant_s, dead_time_s};
}

const std::array<SetPointProfile, 3> kKnownProfiles{
    {{{0, 3}, {2, 5}, {90, 6.5}, {180, 4}, {270, 4.6}, {340, 5.5}},
     {{0, 2}, {5, 4}, {60, 6}, {120, 7.5}, {180, 5}, {260, 3}, {340, 4.5}},
     {{0, 4}, {2, 5}, {120, 4.2}, {200, 6}, {300, 5}}}};

SetPointProfile random_profile(double duration_s, Random& random) {
  SetPointProfile profile{{0.0, random.uniform(2.0, 5.0)}};
  double time_s = random.uniform(1.0, 10.0);
  while (time_s < duration_s - 30.0) {
    const double last = profile.back().second;
    double level = last;
    while (std::abs(level - last) < 0.5) level = random.uniform(2.0, 7.5);
    profile.emplace_back(std::round(time_s / kPeriod_s) * kPeriod_s,
                         std::round(level * 10.0) / 10.0);
    time_s += random.uniform(45.0, 110.0);
  }
  return profile;
}

}  // namespace

Plant draw_common_plant(Random& random) {
  Plant plant = draw_plant(random);
  plant.stem.static_friction = random.uniform(0.0025, 0.02);
  plant.stem.dynamic_friction = plant.stem.static_friction * random.uniform(0.7, 1.0);
  return plant;
}

Plant draw_plant(Random& random) {
  const Process process = draw_process(random);
  Plant plant{};
  plant.gain = process.gain;
  plant.time_constant_s = process.time_constant_s;
  plant.dead_time_s = process.dead_time_s;
  plant.second_lag_s =
      random.chance(0.4) ? process.time_constant_s * random.uniform(0.01, 0.05) : 0.0;
  plant.actuator_lag_s = random.uniform(0.1, 0.3);
  // A healthy packing: 0.06 to 0.2 % of span in all.
  const double friction = random.uniform(0.003, 0.01);
  plant.stem = {friction,
                friction * random.uniform(0.7, 1.0),
                0.0,
                random.uniform(25.0, 50.0),
                random.uniform(0.06, 0.12),
                {}};
  return plant;
}

Tuning draw_tuning(const Draft& draft, Random& random) {
  const Plant& plant = draft.plant;
  const double dead_time_s = plant.dead_time_s + plant.actuator_lag_s;
  const double ratio = dead_time_s / plant.time_constant_s;
  // With a long time constant, the valve limits the gain.
  const double high = ratio < 0.5 ? std::min(draft.tuning_high, 0.62) : draft.tuning_high;
  const double low = std::min(draft.tuning_low, high);
  const double loop_gain = std::min(random.uniform(low, high) / ratio, draft.most_loop_gain);
  // If dead time dominates, engineers choose the integral time longer than tau + L/2.
  const double patience = 1.0 + std::clamp(ratio - 0.4, 0.0, 1.3);
  const double integral_time_s = (plant.time_constant_s + 0.5 * dead_time_s) * patience *
                                 random.uniform(0.75, 1.45) * draft.integral_time_factor;
  const double kp = loop_gain / plant.gain;
  return {kp, kp / integral_time_s};
}

SetPointProfile draw_profile(const Draft& draft, Random& random) {
  if (draft.constant_set_point) {
    return {{0.0, std::round(random.uniform(3.0, 6.0) * 10.0) / 10.0}};
  }
  SetPointProfile profile = random.chance(0.6) ? kKnownProfiles[random.index(kKnownProfiles.size())]
                                               : random_profile(draft.duration_s, random);
  // A short record has the same steps in less time.
  const double squeeze = std::min(1.0, draft.duration_s / 420.0);
  const double reach =
      draft.highest_travel * draft.plant.gain * std::min(draft.gain_factor_at_rest, 1.0);
  double top = 0.0;
  for (const auto& [from_s, level] : profile) top = std::max(top, level);
  const double scale = std::min(1.0, reach / top);
  for (auto& [from_s, level] : profile) {
    from_s = std::round(from_s * squeeze / kPeriod_s) * kPeriod_s;
    level = std::round(level * scale * 100.0) / 100.0;
  }
  return profile;
}

SetPointProfile draw_operated_profile(const Draft& draft, bool later_wide, Random& random) {
  constexpr double kFirst_s = 1200.0;
  const double highest = std::min(
      7.5, draft.highest_travel * draft.plant.gain * std::min(draft.gain_factor_at_rest, 1.0));
  const double middle = random.uniform(0.4, 0.75) * highest;
  SetPointProfile profile{{0.0, std::round(10.0 * middle) / 10.0}};
  double time_s = random.uniform(30.0, 120.0);
  while (time_s < draft.duration_s - 30.0) {
    const double last = profile.back().second;
    const bool wide = later_wide && time_s >= kFirst_s;
    double level = last;
    while (std::abs(level - last) < 0.3) {
      level = wide ? random.uniform(1.5, highest)
                   : std::clamp(middle + random.uniform(-0.3, 0.3) * highest, 1.5, highest);
    }
    profile.emplace_back(std::round(time_s / kPeriod_s) * kPeriod_s,
                         std::round(10.0 * level) / 10.0);
    time_s += random.log_uniform(60.0, time_s < kFirst_s ? 250.0 : 420.0);
  }
  return profile;
}

}  // namespace loopwarden::hidden_cases
