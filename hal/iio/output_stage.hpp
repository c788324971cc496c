// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/iio/analog_settings.hpp"

namespace loopwarden::hal::iio {

// From CO units over mA to the converter's raw number and back. Pure; copied between threads.
class OutputStage {
 public:
  OutputStage() = default;
  // `scale` and `offset` of the channel: physical = (raw + offset) * scale.
  OutputStage(const AnalogOutputSettings& settings, double scale, double offset) noexcept;

  // Whether the converter reaches any current within the limits.
  bool usable() const noexcept { return lowest_raw_ <= highest_raw_; }
  // The raw number nearest to an output within the limits of current and converter.
  std::int64_t raw_for(double output) const noexcept;
  // The same for a current, which only the converter limits.
  std::int64_t raw_for_ma(double current_ma) const noexcept;
  // What a raw number puts out, CO units.
  double output_of(std::int64_t raw) const noexcept;

 private:
  double raw_at_ma(double current_ma) const noexcept;

  double low_ = 0.0;     // CO units at 4 mA
  double per_ma_ = 1.0;  // CO units per mA
  double raw_per_ma_ = 1.0;
  double raw_at_zero_ma_ = 0.0;
  std::int64_t lowest_raw_ = 0;  // of what is ever put out
  std::int64_t highest_raw_ = 0;
  std::int64_t converter_lowest_ = 0;
  std::int64_t converter_highest_ = 0;
};

// CO units for a current; the range's ends at 4 and 20 mA.
constexpr double output_at_ma(const AnalogOutputSettings& settings, double current_ma) noexcept {
  return settings.low + (current_ma - 4.0) / 16.0 * (settings.high - settings.low);
}

}  // namespace loopwarden::hal::iio
