// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>

namespace loopwarden::daemon::console {

// Numbers put behind a text as JSON; what is no number is null.
inline void put(std::string& text, double value, int digits = 6) {
  if (!std::isfinite(value)) {
    text += "null";
  } else if (value == std::trunc(value) && std::abs(value) < 1e15) {
    fmt::format_to(std::back_inserter(text), "{}", static_cast<std::int64_t>(value));
  } else {
    fmt::format_to(std::back_inserter(text), "{:.{}g}", value, digits);
  }
}
inline void put(std::string& text, std::int64_t value) {
  fmt::format_to(std::back_inserter(text), "{}", value);
}

}  // namespace loopwarden::daemon::console
