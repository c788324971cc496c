// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/output_stage.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::hal::iio {
namespace {
constexpr double kSpan = 16.0;  // mA
}  // namespace

OutputStage::OutputStage(const AnalogOutputSettings& settings, double scale, double offset) noexcept
    : low_(settings.low),
      per_ma_((settings.high - settings.low) / kSpan),
      raw_per_ma_(settings.channel.units_per_ma / scale),
      raw_at_zero_ma_(-offset),
      converter_lowest_(settings.lowest_raw),
      converter_highest_(settings.highest_raw) {
  // The limits of current are rounded inwards.
  const auto [least, most] =
      std::minmax({raw_at_ma(settings.lowest_ma), raw_at_ma(settings.highest_ma)});
  const auto within = [this](double raw) {
    return std::clamp(raw, static_cast<double>(converter_lowest_) - 1.0,
                      static_cast<double>(converter_highest_) + 1.0);
  };
  lowest_raw_ = std::max(converter_lowest_, static_cast<std::int64_t>(std::ceil(within(least))));
  highest_raw_ = std::min(converter_highest_, static_cast<std::int64_t>(std::floor(within(most))));
}

double OutputStage::raw_at_ma(double current_ma) const noexcept {
  return current_ma * raw_per_ma_ + raw_at_zero_ma_;
}

std::int64_t OutputStage::raw_for(double output) const noexcept {
  const double raw = std::nearbyint(raw_at_ma(kLiveZero + (output - low_) / per_ma_));
  return static_cast<std::int64_t>(
      std::clamp(raw, static_cast<double>(lowest_raw_), static_cast<double>(highest_raw_)));
}

std::int64_t OutputStage::raw_for_ma(double current_ma) const noexcept {
  return static_cast<std::int64_t>(std::clamp(std::nearbyint(raw_at_ma(current_ma)),
                                              static_cast<double>(converter_lowest_),
                                              static_cast<double>(converter_highest_)));
}

double OutputStage::output_of(std::int64_t raw) const noexcept {
  const double current_ma = (static_cast<double>(raw) - raw_at_zero_ma_) / raw_per_ma_;
  return low_ + (current_ma - kLiveZero) * per_ma_;
}

}  // namespace loopwarden::hal::iio
