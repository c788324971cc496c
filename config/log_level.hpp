// SPDX-License-Identifier: Apache-2.0
// The key log_level of all programs with a log.
#pragma once

#include <array>
#include <string>

#include "config/map_reader.hpp"

namespace loopwarden::config {

inline std::string read_log_level(MapReader& in) {
  constexpr std::array kLevels{
      Choice<const char*>{"debug", "debug"}, Choice<const char*>{"info", "info"},
      Choice<const char*>{"warn", "warn"}, Choice<const char*>{"error", "error"}};
  return in.one_of("log_level", kLevels, "lowest severity that is logged", kLevels[1].value).value;
}

}  // namespace loopwarden::config
