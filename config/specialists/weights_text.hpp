// SPDX-License-Identifier: Apache-2.0
// The file of one specialist's weights:
//
//   loopwarden-weights 1
//   <numbers, separated by blanks or line ends>
//
// Layer by layer and neuron by neuron its weights and then its bias; behind them, for a specialist of
// signatures, the samples of the target. Numbers have single precision.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "model/specialist/judge/network.hpp"

namespace loopwarden::config {

inline constexpr std::size_t kMostNeurons = 256;  // of a layer

std::string weights_text(const specialist::Network& network, const std::vector<double>& target);

struct Weights {
  specialist::Network network;
  std::vector<double> target;
};

// Nothing, and the reason in the report, if there are more or fewer numbers than shape and target take, or one
// that is not finite.
std::optional<Weights> parse_weights(std::string_view text, const specialist::NetworkShape& shape,
                                     std::size_t target_samples, Report& report);

}  // namespace loopwarden::config
