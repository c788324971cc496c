// SPDX-License-Identifier: Apache-2.0
// The inputs of the specialists' networks: one list of numbers that describes the fits of a window.
//
//   misfit            ln(mse / noise^2); the same for the slow course's remainder (innovation)
//   a over healthy    ln(mse_a / mse_healthy)
//   a over b          2 ln(mse_a / mse_b)
//   size              ln(size + 0.1), offset / 2
//   form              4 j/s, 2 knee, ln(rate), ln of the limit over CO's range
//   off               error of the assumed process, in standard deviations of its prior
//   movement          ln(range / noise), ln((travel + 0.1) / (range + 0.1)), ln(fastest + 0.05),
//                     ln(1 + reversals)
//
//   mse                         (% of CO span)^2, 1e-9 added to each
//   noise, size, range, travel  % of CO span
//   rate, fastest               %/s
//
// Each input is limited to -8 to 8, and a value that is no number becomes 0. No input depends on
// units.
//
// No errors for usable fits.
// Limits: the inputs contain no more than the fits. 0.1 and 0.05 keep the logarithms finite. The
// networks learn which inputs matter.
//
// Source: our own choice. Accuracy: docs/explanation/accuracy.md.
//
// The order of the names is that of the inputs of every network on users' disks. To add, remove or
// move a name you need a new version of the manifest (config/specialists).
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "model/specialist/fit/window_fitter.hpp"

namespace loopwarden::specialist {

inline constexpr std::size_t kNetworkInputs = 52;
using NetworkInputs = std::array<double, kNetworkInputs>;

// Returns the name of the input with index `place`, below kNetworkInputs.
std::string_view input_name(std::size_t place) noexcept;

// Returns the inputs for usable fits.
NetworkInputs network_inputs_of(const WindowFits& found) noexcept;

}  // namespace loopwarden::specialist
