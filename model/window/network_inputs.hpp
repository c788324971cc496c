// SPDX-License-Identifier: Apache-2.0
// What the fits of a window amount to, as one list of numbers that the specialists' networks read.
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
// No errors, of fits that are usable.
// Limits: it can't say more than the fits do. 0.1 and 0.05 keep the logarithms finite; which numbers
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

#include "model/window/window_fitter.hpp"

namespace loopwarden::specialist {

inline constexpr std::size_t kNetworkInputs = 52;
using NetworkInputs = std::array<double, kNetworkInputs>;

// Of the input at `place`, below kNetworkInputs.
std::string_view input_name(std::size_t place) noexcept;

// `found` must be usable.
NetworkInputs network_inputs_of(const WindowFits& found) noexcept;

}  // namespace loopwarden::specialist
