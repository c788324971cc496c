// SPDX-License-Identifier: Apache-2.0
// The name, parameters and place of an effect, as a model file states them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace loopwarden::effects {

// The part of the loop that an effect acts on.
enum class Block : std::uint8_t { controller, valve, process, transmitter, disturbance };
const char* to_text(Block block) noexcept;

// An effect by name; make_effect() (catalogue.hpp) turns it into an Effect.
struct EffectSpec {
  std::string name;
  std::map<std::string, double> parameters{};      // as in the catalogue, units there
  std::map<std::string, std::string> options{};    // e.g. law: karnopp
  std::vector<std::pair<double, double>> table{};  // points of a characteristic, CO units

  friend bool operator==(const EffectSpec&, const EffectSpec&) = default;
};

}  // namespace loopwarden::effects
