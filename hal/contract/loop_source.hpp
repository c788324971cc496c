// SPDX-License-Identifier: Apache-2.0
// The contract of a source that is only read: a loop that another controller runs. The interface
// has no function that writes.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <system_error>
#include <vector>

#include "hal/contract/device.hpp"
#include "hal/contract/sample.hpp"

namespace loopwarden::hal {

// A value and the sign of life of its source. If values are sent on change only, an old value still
// holds while its source is alive. It becomes bad when the source dies.
struct SourceSample {
  Sample sample;
  std::int64_t alive_ns = 0;  // CLOCK_MONOTONIC, newest sign of life of the source; 0: not yet
};

struct SourceInputs {
  SourceSample process_variable;  // PV units
  SourceSample output;            // CO units
  SourceSample set_point;         // PV units; this and the next: meaningless if not fitted
  SourceSample stem;              // CO units
  SourceSample mode;              // number of the other controller's mode
};

// Meaning of the other controller's mode numbers or words. Any other number is a third mode.
struct ModeValues {
  std::vector<double> automatic;
  std::vector<double> manual;

  friend bool operator==(const ModeValues&, const ModeValues&) = default;
};

inline constexpr std::size_t kLongestWord = 64;                    // bytes
inline constexpr double kLargestNumber = 4'503'599'627'370'496.0;  // of a word as mode: 2^52

// Returns the number that represents a word as mode, for a source that sends AUTO instead of 1. A
// text that is a number becomes that number. Any other text becomes at least 2^52, by a hash of 52
// bits (FNV-1a; Fowler, Noll, Vo, 1991), so that no usual number equals a word.
inline double number_of_word(std::string_view word) noexcept {
  double number = 0.0;
  const auto parsed = std::from_chars(word.data(), word.data() + word.size(), number);
  const bool all = parsed.ec == std::errc() && parsed.ptr == word.data() + word.size();
  if (all && std::isfinite(number)) return number;
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const char c : word) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return kLargestNumber + static_cast<double>(hash >> 12U);
}

inline bool holds(const std::vector<double>& values, double value) noexcept {
  return std::find(values.begin(), values.end(), std::round(value)) != values.end();
}

class LoopSource : public Device {
 public:
  // Returns the newest inputs, whatever their age. One thread, the same for all sources.
  virtual void read(SourceInputs& inputs) noexcept = 0;
};

}  // namespace loopwarden::hal
