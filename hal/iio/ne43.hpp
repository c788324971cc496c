// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/contract/sample.hpp"
#include "hal/iio/analog_settings.hpp"

namespace loopwarden::hal::iio {

// Classifies a 4-20 mA current by NAMUR NE 43:
//
//   below failure_low            failure: bad after entry_samples in a row, held until then
//   up to measure_low            neither measurement nor failure: held, uncertain
//   up to 4 mA                   good, at the low limit
//   4 to 20 mA                   good
//   up to measure_high           good, at the high limit
//   up to failure_high           held, uncertain
//   above                        failure
//
// Bad is left only after recovery_s continuously between measure_low and measure_high. "Held" means
// that the previous sample remains, with its own time, so that its age grows.
class Ne43 {
 public:
  explicit Ne43(const Ne43Settings& settings) noexcept : settings_(settings) {}

  struct Reading {
    Quality quality = Quality::bad;
    Reason reason = Reason::never_received;
    Limit limit = Limit::none;  // of the current; reversed for a reversed range
    bool fresh = false;  // true: the current is a measurement; false: hold the previous sample
  };

  // Classifies one reading. NaN and infinity count as a failure current.
  Reading step(double current_ma, std::int64_t time_ns) noexcept;

  // Records a missing reading: the recovery time starts again.
  void interrupted() noexcept { recovering_ = false; }

 private:
  Ne43Settings settings_;
  int failures_ = 0;  // in a row
  bool bad_ = false;
  bool measured_ = false;  // there is a sample to hold
  bool recovering_ = false;
  std::int64_t recovering_since_ns_ = 0;
};

}  // namespace loopwarden::hal::iio
