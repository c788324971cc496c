// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "lab/hidden_cases/draft.hpp"

namespace loopwarden::hidden_cases {
namespace {

using std::numbers::pi;

void add_note(Draft& draft, const std::string& text) {
  if (!draft.note.empty()) draft.note += "; ";
  draft.note += text;
}

// --- Valve ---------------------------------------------------------------------------------------

Stem sticky_stem(double s, double j, Random& random) {
  Stem stem{};
  stem.static_friction = 0.5 * (s + j);
  stem.dynamic_friction = 0.5 * (s - j);
  stem.frequency_rad_s = random.uniform(15.0, 50.0);
  // A slip takes some tenths of a second and does not oscillate.
  stem.damping_s = std::max(random.log_uniform(0.04, 0.2), 1.6 / stem.frequency_rad_s);
  return stem;
}

void stiction(Draft& draft, Random& random) {
  const double s = random.uniform(0.6, 1.7);
  const double j = s * random.uniform(0.12, 0.65);
  draft.parameters["s"] = s;
  draft.parameters["j"] = j;
  Stem stem = sticky_stem(s, j, random);
  switch (random.index(3)) {
    case 0:
      add_note(draft, "friction after Karnopp");
      draft.stem = make_karnopp_stem(stem);
      break;
    case 1:
      add_note(draft, "friction after Karnopp, Stribeck");
      stem.stribeck_per_s = random.uniform(0.005, 0.02);
      draft.stem = make_karnopp_stem(stem);
      break;
    default:
      add_note(draft, "friction after LuGre");
      // Below this speed the bristles release well before the static friction is reached.
      stem.stribeck_per_s = random.uniform(0.02, 0.05);
      draft.stem = make_lugre_stem(stem, random.uniform(40.0, 100.0));
  }
}

void backlash(Draft& draft, Random& random) {
  const double width = random.uniform(0.45, 1.5);
  draft.parameters["deadband"] = width;
  draft.after_stem.push_back(make_linkage_play(width, random.log_uniform(0.01, 0.08)));
}

PlayStack draw_play_stack(double width, Random& random) {
  const std::size_t count = 3 + random.index(5);
  PlayStack stack;
  double weights = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    stack.half_widths.push_back(random.uniform(0.05, 1.0));
    stack.weights.push_back(-std::log(1.0 - random.uniform()));
    weights += stack.weights.back();
  }
  const double direct = random.uniform(0.0, 0.3);
  double mean = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    stack.weights[i] *= (1.0 - direct) / weights;
    mean += stack.weights[i] * stack.half_widths[i];
  }
  for (double& half : stack.half_widths) half *= 0.5 * width / mean;
  stack.half_widths.push_back(0.0);
  stack.weights.push_back(direct);
  return stack;
}

void hysteresis(Draft& draft, Random& random) {
  const double width = random.uniform(0.5, 1.3);
  draft.parameters["width"] = width;
  if (random.chance(0.5)) {
    add_note(draft, "hysteresis after Bouc and Wen");
    // With a scale above half the width the output never moves against the input.
    draft.after_stem.push_back(make_bouc_wen({width, width * random.uniform(0.6, 1.1),
                                              random.uniform(1.0, 2.0), random.uniform(0.5, 0.8)}));
  } else {
    add_note(draft, "hysteresis after Prandtl and Ishlinskii, unequal weights");
    draft.after_stem.push_back(make_play_stack(draw_play_stack(width, random)));
  }
}

void low_air_supply(Draft& draft, Random& random) {
  AirSupply air{};
  air.fill_per_s = random.log_uniform(0.15, 0.4);
  air.vent_per_s = air.fill_per_s;
  air.supply = random.uniform(5.6, 7.8);
  air.lag_s = random.uniform(0.8, 2.0);
  draft.parameters["rate"] = air.fill_per_s;
  draft.parameters["travel_limit"] = air.supply;
  draft.parameters["lag"] = air.lag_s;
  const std::size_t variant = random.index(5);
  if (variant == 3) {
    add_note(draft, "vents faster than it fills");
    air.vent_per_s *= random.uniform(2.5, 6.0);
  } else if (variant == 4) {
    add_note(draft, "filling slows towards the supply; rate is that at half the supply");
    air.choked = true;
  }
  draft.before_stem.push_back(make_air_supply(air));
  draft.highest_travel = 1.15 * air.supply;
  draft.most_time_at_stops = 0.4;
}

double equal_percentage(double opening, double rangeability) {
  return std::pow(rangeability, opening - 1.0);
}

// Returns the share of the full flow if the valve has only `share` of the pressure drop at full
// flow.
double installed(double inherent, double share) {
  return inherent / std::sqrt(share + (1.0 - share) * inherent * inherent);
}

void valve_characteristic(Draft& draft, Random& random) {
  std::function<double(double)> curve;
  const double rangeability = random.uniform(20.0, 50.0);
  const std::size_t variant = random.index(5);
  if (variant <= 1) {
    add_note(draft, fmt::format("equal_percentage, rangeability {:.1f}", rangeability));
    curve = [=](double x) { return equal_percentage(x, rangeability); };
  } else if (variant == 2) {
    const double share = random.uniform(0.3, 0.8);
    add_note(draft, fmt::format("equal_percentage, rangeability {:.1f}, installed with {:.2f} of "
                                "the pressure drop",
                                rangeability, share));
    curve = [=](double x) { return installed(equal_percentage(x, rangeability), share); };
  } else if (variant == 3) {
    const double share = random.uniform(0.12, 0.4);
    add_note(draft, fmt::format("linear, installed with {:.2f} of the pressure drop", share));
    curve = [=](double x) { return installed(x, share); };
  } else {
    const double bend = random.uniform(0.5, 0.85);
    add_note(draft, fmt::format("S-shaped: x - {:.2f} sin(2 pi x) / (2 pi)", bend));
    curve = [=](double x) { return x - bend * std::sin(2.0 * pi * x) / (2.0 * pi); };
  }
  draft.after_stem.push_back(
      make_curve([curve](double u) { return 10.0 * curve(std::clamp(0.1 * u, 0.0, 1.0)); }));
  draft.tuning_high = std::min(draft.tuning_high, 0.6);
  draft.highest_travel = 8.0;
}

void positioner_overshoot(Draft& draft, Random& random) {
  const double damping = random.uniform(0.12, 0.32);
  const double frequency = random.log_uniform(0.5, 1.1);
  draft.parameters["damping"] = damping;
  draft.parameters["natural_frequency"] = frequency;
  const bool third = random.chance(0.5);
  if (third) add_note(draft, "third pole");
  draft.before_stem.push_back(
      make_positioner(frequency, damping, third ? random.uniform(0.1, 0.3) / frequency : 0.0));
  draft.tuning_high = std::min(draft.tuning_high, 0.5);
  // The resonance must not make the loop unstable.
  draft.most_loop_gain = 3.0 * damping * draft.plant.time_constant_s * frequency;
}

// --- Process, transmitter, disturbance, controller -----------------------------------------------

void gain_change(Draft& draft, Random& random) {
  const double factor = random.chance(0.5) ? random.uniform(0.65, 0.85) : random.uniform(1.18, 1.4);
  draft.parameters["factor"] = factor;
  draft.gain_factor = [factor](double) { return factor; };
  draft.gain_factor_at_rest = factor;
  draft.tuning_high = std::min(draft.tuning_high, 0.62);
}

void extra_dead_time(Draft& draft, Random& random) {
  draft.extra_dead_time_s = random.uniform(0.6, 1.9);
  draft.parameters["seconds"] = draft.extra_dead_time_s;
  draft.tuning_high = std::min(draft.tuning_high, 0.55);
}

void extra_lag(Draft& draft, Random& random) {
  const double lag_s = random.uniform(1.5, 4.5);
  draft.parameters["time_constant"] = lag_s;
  draft.after_process.push_back(make_lag(lag_s));
  draft.tuning_high = std::min(draft.tuning_high, 0.5);
}

void output_bias(Draft& draft, Random& random) {
  const double bias = random.sign() * random.uniform(0.3, 0.8);
  draft.parameters["bias"] = bias;
  draft.added.emplace_back([bias](double) { return bias; });
}

void drift(Draft& draft, Random& random) {
  const double rate = random.sign() * random.uniform(0.0013, 0.0038);
  draft.parameters["rate"] = rate;
  draft.added.emplace_back([rate](double t) { return rate * std::max(t, 0.0); });
}

void oscillating_disturbance(Draft& draft, Random& random) {
  const double amplitude = random.uniform(0.15, 0.5);
  const double period_s = random.log_uniform(14.0, 70.0);
  const double phase = random.uniform(0.0, 2.0 * pi);
  draft.parameters["amplitude"] = amplitude;
  draft.parameters["period"] = period_s;
  draft.added.emplace_back(
      [=](double t) { return amplitude * std::sin(2.0 * pi * t / period_s + phase); });
}

void step_disturbance(Draft& draft, Random& random) {
  const double size = random.sign() * random.uniform(0.4, 1.0);
  const double time_s = draft.duration_s * random.uniform(0.2, 0.55);
  draft.parameters["size"] = size;
  draft.parameters["time"] = time_s;
  draft.added.emplace_back([=](double t) { return t >= time_s ? size : 0.0; });
}

void controller_mismatch(Draft& draft, Random& random) {
  const bool slower = random.chance(0.75);
  draft.kp_factor = slower ? random.uniform(0.4, 0.7) : random.uniform(1.3, 1.6);
  draft.ki_factor = slower ? random.uniform(0.4, 0.7) : random.uniform(1.3, 1.6);
  if (!slower) draft.tuning_high = std::min(draft.tuning_high, 0.42);
}

// --- No hidden effect ----------------------------------------------------------------------------

void nothing(Draft& /*draft*/, Random& /*random*/) {}

void aggressive_tuning(Draft& draft, Random& /*random*/) {
  add_note(draft, "aggressive tuning, the loop oscillates");
  draft.tuning_low = 0.65;
  draft.tuning_high = 0.9;
  draft.integral_time_factor = 0.7;
}

void sluggish_tuning(Draft& draft, Random& /*random*/) {
  add_note(draft, "sluggish tuning");
  draft.tuning_low = 0.08;
  draft.tuning_high = 0.15;
  draft.integral_time_factor = 1.4;
}

void constant_set_point(Draft& draft, Random& /*random*/) {
  add_note(draft, "constant set point");
  draft.constant_set_point = true;
}

// --- Outside the catalogue -----------------------------------------------------------------------

void inverse_response(Draft& draft, Random& random) {
  const double lag_s = draft.plant.time_constant_s;
  draft.core = make_inverse_response(lag_s * random.uniform(0.4, 0.9), lag_s,
                                     lag_s * random.uniform(0.3, 0.5));
  draft.tuning_high = 0.28;
  draft.most_loop_gain = 0.8;
}

void underdamped_process(Draft& draft, Random& random) {
  const double damping = random.uniform(0.18, 0.35);
  const double frequency = random.uniform(1.0, 1.8) / draft.plant.time_constant_s;
  draft.core = make_positioner(frequency, damping, 0.0);
  draft.most_loop_gain = damping;
  draft.integral_time_factor = 0.8;
}

void pv_spikes(Draft& draft, Random& random) {
  std::vector<std::array<double, 3>> spikes;  // from, to, size
  const double every_s = random.uniform(8.0, 22.0);
  for (double t = 0.0; t < draft.duration_s;) {
    t += -every_s * std::log(1.0 - random.uniform());
    const double size = random.sign() * random.uniform(0.5, 2.5);
    spikes.push_back({t, t + kPeriod_s * static_cast<double>(1 + random.index(8)), size});
  }
  draft.added.emplace_back([spikes](double t) {
    double sum = 0.0;
    for (const auto& [from_s, to_s, size] : spikes) sum += t >= from_s && t < to_s ? size : 0.0;
    return sum;
  });
}

Intervals draw_intervals(double duration_s, double shortest_s, double longest_s, Random& random) {
  Intervals intervals;
  double t = random.uniform(0.0, longest_s);
  while (t < duration_s) {
    const double to_s = t + random.uniform(shortest_s, longest_s);
    intervals.emplace_back(t, to_s);
    t = to_s + random.uniform(shortest_s, longest_s);
  }
  return intervals;
}

void intermittent_sticking(Draft& draft, Random& random) {
  const double s = random.uniform(1.0, 2.0);
  Stem stem = sticky_stem(s, s * random.uniform(0.2, 0.6), random);
  stem.gripped = draw_intervals(draft.duration_s, 25.0, 70.0, random);
  draft.stem = make_karnopp_stem(stem);
}

void stuck_stretches(Draft& draft, Random& random) {
  Stem stem = sticky_stem(100.0, 1.0, random);
  stem.gripped = draw_intervals(draft.duration_s, 30.0, 60.0, random);
  draft.stem = make_karnopp_stem(stem);
  draft.most_time_at_stops = 1.0;
  draft.most_tail_error = 2.0;
}

void leakage(Draft& draft, Random& random) {
  const double leak = random.uniform(3.2, 4.2);
  draft.after_stem.push_back(make_curve([leak](double v) { return std::max(v, leak); }));
  draft.most_time_at_stops = 1.0;
}

void wandering_gain(Draft& draft, Random& random) {
  const double spread = random.uniform(0.06, 0.12);
  const double memory_s = random.uniform(30.0, 70.0);
  const double forget = std::exp(-1.0 / memory_s);
  std::vector<double> table{0.0};
  while (static_cast<double>(table.size()) < draft.duration_s + 2.0) {
    table.push_back(forget * table.back() +
                    spread * std::sqrt(1.0 - forget * forget) * random.normal());
  }
  draft.gain_factor = [table](double t) {
    const double place = std::clamp(t, 0.0, static_cast<double>(table.size() - 2));
    const auto k = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(k);
    return 1.0 + (1.0 - part) * table[k] + part * table[k + 1];
  };
  draft.tuning_high = 0.6;
}

void square_disturbance(Draft& draft, Random& random) {
  const double size = random.uniform(0.2, 0.5);
  const double period_s = random.uniform(30.0, 90.0);
  draft.added.emplace_back([=](double t) {
    return std::fmod(std::max(t, 0.0), period_s) < 0.5 * period_s ? size : -size;
  });
}

void telegraph_disturbance(Draft& draft, Random& random) {
  const double size = random.uniform(0.2, 0.5);
  const double mean_s = random.uniform(12.0, 35.0);
  std::vector<double> flips;
  for (double t = 0.0; t < draft.duration_s;) {
    t += -mean_s * std::log(1.0 - random.uniform());
    flips.push_back(t);
  }
  draft.added.emplace_back([=](double t) {
    const auto count = std::upper_bound(flips.begin(), flips.end(), t) - flips.begin();
    return count % 2 == 0 ? size : -size;
  });
}

void chirp_disturbance(Draft& draft, Random& random) {
  const double size = random.uniform(0.2, 0.5);
  const double from_hz = 1.0 / random.uniform(50.0, 80.0);
  const double to_hz = 1.0 / random.uniform(12.0, 20.0);
  const double slope = (to_hz - from_hz) / draft.duration_s;
  draft.added.emplace_back(
      [=](double t) { return size * std::sin(2.0 * pi * t * (from_hz + 0.5 * slope * t)); });
}

void two_way_time_constant(Draft& draft, Random& random) {
  const double ratio = std::sqrt(random.uniform(2.5, 5.0));
  const double lag_s = draft.plant.time_constant_s;
  const bool slow_up = random.chance(0.5);
  draft.core = make_two_way_lag(slow_up ? lag_s * ratio : lag_s / ratio,
                                slow_up ? lag_s / ratio : lag_s * ratio);
  draft.tuning_high = 0.4;
}

void dead_time_with_flow(Draft& draft, Random& random) {
  const double usual_flow = random.uniform(4.0, 5.5) / draft.plant.gain;
  draft.transport = make_plug_flow(draft.plant.dead_time_s * usual_flow);
  draft.tuning_high = 0.35;
}

void saturating_transmitter(Draft& draft, Random& random) {
  draft.transmitter_short_of_top = random.uniform(0.4, 1.2);
  draft.most_time_at_stops = 1.0;
  draft.most_tail_error = 2.0;
}

void staircase_positioner(Draft& draft, Random& random) {
  const double grid = random.uniform(0.4, 0.9);
  draft.before_stem.push_back(make_curve([grid](double u) { return grid * std::round(u / grid); }));
}

void recycle(Draft& draft, Random& random) {
  draft.after_process.push_back(
      make_recycle(random.uniform(0.3, 0.55), random.uniform(15.0, 40.0)));
}

void slow_tail(Draft& draft, Random& random) {
  draft.after_process.push_back(
      make_slow_tail(random.uniform(0.25, 0.45), random.uniform(30.0, 80.0)));
}

// --- Later additions to the catalogue ------------------------------------------------------------

void resolution(Draft& draft, Random& random) {
  const double step = random.uniform(0.35, 0.9);
  draft.parameters["step"] = step;
  draft.before_stem.push_back(
      make_stepping_drive(step, random.uniform(0.0, 0.05), random.uniform(0.03, 0.08)));
}

void opposing_ways(Draft& draft, Random& random) {
  const double slow_s = draft.plant.time_constant_s;
  const double fast_s = slow_s * random.uniform(0.03, 0.08);
  const double zero_s = slow_s * random.uniform(0.3, 0.7);
  draft.parameters["zero_time"] = zero_s;
  // (1 + g) / (slow s + 1) - g / (fast s + 1) has its zero where g slow - (1 + g) fast = zero.
  draft.core = make_opposing_lags((zero_s + fast_s) / (slow_s - fast_s), slow_s, fast_s);
  draft.tuning_high = 0.28;
  draft.most_loop_gain = 0.8;
}

void ramp_disturbance(Draft& draft, Random& random) {
  const double size = random.sign() * random.uniform(0.4, 1.0);
  const double from_s = draft.duration_s * random.uniform(0.1, 0.3);
  const double length_s = draft.duration_s * random.uniform(0.1, 0.25);
  draft.parameters["size"] = size;
  draft.parameters["from"] = from_s;
  draft.parameters["to"] = from_s + length_s;
  // An operator turns another valve: slower at the start and at the end.
  draft.added.emplace_back([=](double t) {
    const double part = std::clamp((t - from_s) / length_s, 0.0, 1.0);
    return size * (part - 0.4 * std::sin(2.0 * pi * part) / (2.0 * pi));
  });
}

void switching_load(Draft& draft, Random& random) {
  const double amplitude = random.uniform(0.2, 0.5);
  const double period_s = random.uniform(20.0, 80.0);
  const double phase = random.uniform(-pi, pi);
  const double edge_s = random.uniform(0.1, 0.4);
  draft.parameters["amplitude"] = amplitude;
  draft.parameters["period"] = period_s;
  // A switched load changes with a lag.
  draft.added.emplace_back([=](double t) {
    const double halves = 2.0 * (t / period_s + phase / (2.0 * pi));
    const double since_s = (halves - std::floor(halves)) * period_s / 2.0;
    const bool on = std::fmod(std::floor(halves) + 1e6, 2.0) < 0.5;
    return (on ? amplitude : -amplitude) * (1.0 - 2.0 * std::exp(-since_s / edge_s));
  });
}

void connected_tanks(Draft& draft, Random& random) {
  const double damping = random.uniform(0.2, 0.4);
  const double frequency = random.uniform(1.0, 1.8) / draft.plant.time_constant_s;
  draft.parameters["damping"] = damping;
  draft.parameters["natural_frequency"] = frequency;
  draft.core = make_connected_tanks(frequency, damping, random.uniform(10.0, 30.0));
  draft.most_loop_gain = damping;
  draft.integral_time_factor = 0.8;
}

void fouling(Draft& draft, Random& random) {
  const double end = random.chance(0.5) ? random.uniform(0.6, 0.8) : random.uniform(1.2, 1.4);
  const double from_s = draft.duration_s * random.uniform(0.05, 0.3);
  const double memory_s = draft.duration_s * random.uniform(0.06, 0.12);
  draft.gain_factor = [=](double t) {
    return end + (1.0 - end) * std::exp(-std::max(0.0, t - from_s) / memory_s);
  };
  draft.tuning_high = 0.6;
}

void one_sticky_stretch(Draft& draft, Random& random) {
  const double s = random.uniform(1.0, 2.0);
  const double j = s * random.uniform(0.2, 0.6);
  const double from_s = draft.duration_s * random.uniform(0.08, 0.25);
  const double to_s = from_s + draft.duration_s * random.uniform(0.2, 0.35);
  draft.parameters["s"] = s;
  draft.parameters["j"] = j;
  draft.parameters["from"] = from_s;
  draft.parameters["to"] = to_s;
  Stem stem = sticky_stem(s, j, random);
  stem.gripped = {{from_s, to_s}};
  draft.stem = make_karnopp_stem(stem);
}

void held_measurement(Draft& draft, Random& random) {
  draft.reading_stands = 8 + random.index(22);
  draft.parameters["interval"] = kPeriod_s * static_cast<double>(draft.reading_stands);
  draft.tuning_high = 0.4;
}

// Slow at first, as dirt accumulates.
void plugging(Draft& draft, Random& random) {
  const double end_s =
      (draft.plant.time_constant_s + draft.plant.dead_time_s) * random.uniform(0.6, 2.0);
  const double bend = random.uniform(0.9, 1.3);
  draft.parameters["rate"] = end_s / draft.duration_s;
  draft.line_lag_s = [end_s, bend, duration_s = draft.duration_s](double t) {
    return end_s * std::pow(t / duration_s, bend);
  };
  draft.tuning_high = 0.4;
}

// A power of the range instead of a straight line.
void meter_curve(Draft& draft, Random& random) {
  const double power = random.chance(0.5) ? random.uniform(0.5, 0.75) : random.uniform(1.4, 2.0);
  draft.meter = [power](double q) {
    return 10.0 * std::pow(std::clamp(q, 0.0, 10.0) / 10.0, power);
  };
  draft.tuning_high = 0.4;
}

void stiction_on_closing(Draft& draft, Random& random) {
  const double s = random.uniform(0.6, 1.2);
  const double j = s * random.uniform(0.15, 0.5);
  const double more = random.uniform(1.4, 2.0);
  draft.parameters["s"] = s;
  draft.parameters["j"] = j;
  draft.parameters["s_closing"] = more * s;
  draft.parameters["j_closing"] = more * j;
  Stem stem = sticky_stem(s, j, random);
  stem.closing_friction = more;
  draft.stem = make_karnopp_stem(stem);
}

using Apply = void (*)(Draft&, Random&);
constexpr std::array<std::pair<std::string_view, Apply>, 47> kEffects{{
    {"stiction", stiction},
    {"backlash", backlash},
    {"hysteresis", hysteresis},
    {"low_air_supply", low_air_supply},
    {"valve_characteristic", valve_characteristic},
    {"positioner_overshoot", positioner_overshoot},
    {"gain_change", gain_change},
    {"extra_dead_time", extra_dead_time},
    {"extra_lag", extra_lag},
    {"output_bias", output_bias},
    {"drift", drift},
    {"oscillating_disturbance", oscillating_disturbance},
    {"step_disturbance", step_disturbance},
    {"controller_mismatch", controller_mismatch},
    {"none", nothing},
    {"none:aggressive_tuning", aggressive_tuning},
    {"none:sluggish_tuning", sluggish_tuning},
    {"none:constant_set_point", constant_set_point},
    {"outside:inverse_response", inverse_response},
    {"outside:underdamped_process", underdamped_process},
    {"outside:pv_spikes", pv_spikes},
    {"outside:intermittent_sticking", intermittent_sticking},
    {"outside:stuck_stretches", stuck_stretches},
    {"outside:leakage", leakage},
    {"outside:wandering_gain", wandering_gain},
    {"outside:square_disturbance", square_disturbance},
    {"outside:telegraph_disturbance", telegraph_disturbance},
    {"outside:chirp_disturbance", chirp_disturbance},
    {"outside:two_way_time_constant", two_way_time_constant},
    {"outside:dead_time_with_flow", dead_time_with_flow},
    {"outside:saturating_transmitter", saturating_transmitter},
    {"outside:staircase_positioner", staircase_positioner},
    {"outside:recycle", recycle},
    {"outside:slow_tail", slow_tail},
    {"resolution", resolution},
    {"inverse_response", opposing_ways},
    {"ramp_disturbance", ramp_disturbance},
    {"square_disturbance", switching_load},
    {"oscillatory_process", connected_tanks},
    {"varying_gain", fouling},
    {"intermittent_stiction", one_sticky_stretch},
    {"clipped_measurement", saturating_transmitter},
    {"held_measurement", held_measurement},
    {"stiction:closing", stiction_on_closing},
    {"flow_dependent_dead_time", dead_time_with_flow},
    {"plugging", plugging},
    {"meter_curve", meter_curve},
}};

}  // namespace

void apply_effect(std::string_view name, Draft& draft, Random& random) {
  for (const auto& [known, apply] : kEffects) {
    if (known == name) return apply(draft, random);
  }
  throw std::invalid_argument(fmt::format("no hidden effect is called '{}'", name));
}

}  // namespace loopwarden::hidden_cases
