// SPDX-License-Identifier: Apache-2.0
// Reads and writes the file of one specialist's weights:
//
//   loopwarden-weights 1
//   <numbers, separated by blanks or line ends>
//
// The numbers are, layer by layer and neuron by neuron, its weights and then its bias. For a
// signature specialist, the samples of the target follow. Numbers have single precision.
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

// Returns nullopt and reports the reason if the number of values does not match shape and target,
// or if a value is not finite.
std::optional<Weights> parse_weights(std::string_view text, const specialist::NetworkShape& shape,
                                     std::size_t target_samples, Report& report);

}  // namespace loopwarden::config
