// SPDX-License-Identifier: Apache-2.0
// What the explanations of a window amount to, as one list of numbers that the specialists' networks read.
//
//   misfit            ln(mse / noise^2), of the slow course's rest (innovation) likewise
//   a over healthy    ln(mse_a / mse_healthy)         a over b    2 ln(mse_a / mse_b)
//   size              ln(size + 0.1), offset / 2      form        4 j/s, 2 knee, ln(rate), ln of the limit over CO's range
//   what the belief is off by     standard deviations of its prior
//   movement          ln(range / noise), ln((travel + 0.1) / (range + 0.1)), ln(fastest + 0.05), ln(1 + reversals)
//
//   mse  (% of CO span)^2, 1e-9 added to each     noise, size, range, travel  % of CO span     rate, fastest  %/s
//
// Each is held within -8 to 8, and what is no number is 0: nothing depends on units.
//
// Errors: none, of explanations that are usable.
// What it can't do: say more than the explanations do. 0.1 and 0.05 keep the logarithms finite; which numbers
// matter is left to the networks.
//
// Source: none: the choice is ours, and docs/specialists.md says how far it carries.
//
// The order of the names is that of the inputs of every network on users' disks: a name that is added, taken
// away or moved needs a new version of the manifest (config/specialists).
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "model/window/explainer.hpp"

namespace loopwarden::specialist {

inline constexpr std::array kInputNames{
    // misfit of each explanation over the noise
    std::string_view("healthy_misfit"), std::string_view("healthy_innovation"),
    std::string_view("other_process_misfit"), std::string_view("other_process_innovation"),
    std::string_view("backlash_misfit"), std::string_view("backlash_innovation"),
    std::string_view("stiction_misfit"), std::string_view("stiction_innovation"),
    std::string_view("width_misfit"), std::string_view("width_innovation"),
    std::string_view("offset_misfit"), std::string_view("offset_innovation"),
    std::string_view("low_air_misfit"), std::string_view("low_air_innovation"),
    // over the healthy valve's
    std::string_view("other_process_over_healthy"),
    std::string_view("other_process_innovation_over_healthy"),
    std::string_view("backlash_over_healthy"), std::string_view("backlash_innovation_over_healthy"),
    std::string_view("stiction_over_healthy"), std::string_view("stiction_innovation_over_healthy"),
    std::string_view("width_over_healthy"), std::string_view("width_innovation_over_healthy"),
    std::string_view("offset_over_healthy"), std::string_view("offset_innovation_over_healthy"),
    std::string_view("low_air_over_healthy"), std::string_view("low_air_innovation_over_healthy"),
    // of faults over each other, and their sizes
    std::string_view("backlash_size"), std::string_view("stiction_over_backlash"),
    std::string_view("stiction_size"), std::string_view("width_over_backlash"),
    std::string_view("width_over_stiction"), std::string_view("width_size"),
    std::string_view("low_air_over_backlash"), std::string_view("low_air_over_stiction"),
    std::string_view("low_air_over_width"), std::string_view("low_air_size"),
    std::string_view("offset_size"),
    // forms
    std::string_view("stiction_jump"), std::string_view("width_knee"),
    std::string_view("low_air_rate"), std::string_view("low_air_limit"),
    // what the belief is off by
    std::string_view("healthy_gain_off"), std::string_view("healthy_dead_time_off"),
    std::string_view("healthy_lag_off"), std::string_view("other_process_gain_off"),
    std::string_view("other_process_dead_time_off"), std::string_view("other_process_lag_off"),
    // movement
    std::string_view("co_range_over_noise"), std::string_view("pv_range_over_noise"),
    std::string_view("co_travel_over_range"), std::string_view("co_fastest"),
    std::string_view("co_reversals")};

inline constexpr std::size_t kNetworkInputs = kInputNames.size();
using NetworkInputs = std::array<double, kNetworkInputs>;

// Place of a name in the list; a name that isn't there does not compile.
consteval std::size_t input_index(std::string_view name) {
  for (std::size_t i = 0; i < kNetworkInputs; ++i) {
    if (kInputNames[i] == name) return i;
  }
  throw "no input of this name";
}

// `explanations` must be usable.
NetworkInputs network_inputs_of(const Explanations& explanations) noexcept;

}  // namespace loopwarden::specialist
