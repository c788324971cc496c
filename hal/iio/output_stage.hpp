// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/iio/analog_settings.hpp"

namespace loopwarden::hal::iio {

// Converts CO units to mA to the converter's raw number, and back. No state beyond its settings;
// copied between threads.
class OutputStage {
 public:
  OutputStage() = default;
  // `scale` and `offset` of the channel: physical = (raw + offset) * scale.
  OutputStage(const AnalogOutputSettings& settings, double scale, double offset) noexcept;

  // Returns whether the converter can output any current within the limits.
  bool usable() const noexcept { return lowest_raw_ <= highest_raw_; }
  // Returns the raw number nearest to an output, within the limits of current and converter.
  std::int64_t raw_for(double output) const noexcept;
  // Returns the raw number for a current, within the converter's limits only.
  std::int64_t raw_for_ma(double current_ma) const noexcept;
  // Returns the output for a raw number, CO units.
  double output_of(std::int64_t raw) const noexcept;

 private:
  double raw_at_ma(double current_ma) const noexcept;

  double low_ = 0.0;     // CO units at 4 mA
  double per_ma_ = 1.0;  // CO units per mA
  double raw_per_ma_ = 1.0;
  double raw_at_zero_ma_ = 0.0;
  std::int64_t lowest_raw_ = 0;  // limits of the output
  std::int64_t highest_raw_ = 0;
  std::int64_t converter_lowest_ = 0;
  std::int64_t converter_highest_ = 0;
};

// Returns CO units for a current. The ends of the range are at 4 and 20 mA.
constexpr double output_at_ma(const AnalogOutputSettings& settings, double current_ma) noexcept {
  return settings.low + (current_ma - 4.0) / 16.0 * (settings.high - settings.low);
}

}  // namespace loopwarden::hal::iio
