// SPDX-License-Identifier: Apache-2.0
// The contract of what is only read: a loop that another controller runs. Nothing here takes a value.
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

// A value and the life of what delivers it. Where values come on change alone, one that grew old while
// its source is alive still holds; one whose source has died does not.
struct SourceSample {
  Sample sample;
  std::int64_t alive_ns = 0;  // CLOCK_MONOTONIC, newest sign of life of the source; 0: none yet
};

struct SourceInputs {
  SourceSample process_variable;  // PV units
  SourceSample output;            // CO units
  SourceSample set_point;         // PV units; as below, meaningless where it is not fitted
  SourceSample stem;              // CO units
  SourceSample mode;              // a number of the other controller
};

// What the numbers, or words, of the other controller's mode mean; any other one is a third mode.
struct ModeValues {
  std::vector<double> automatic;
  std::vector<double> manual;

  friend bool operator==(const ModeValues&, const ModeValues&) = default;
};

inline constexpr std::size_t kLongestWord = 64;  // bytes
inline constexpr double kLargestNumber =
    4'503'599'627'370'496.0;  // of a mode that is no word: 2^52

// The number that stands for a word as mode, of a source that sends AUTO in place of 1. A text that is a number is that
// number; any other is at least 2^52, by a hash of 52 bits (FNV-1a; Fowler, Noll, Vo, 1991), so that no number a source
// sends is taken for a word.
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
  // One thread, the same for all sources: newest inputs, whatever their age.
  virtual void read(SourceInputs& inputs) noexcept = 0;
};

}  // namespace loopwarden::hal
