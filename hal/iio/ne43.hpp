// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/contract/sample.hpp"
#include "hal/iio/analog_settings.hpp"

namespace loopwarden::hal::iio {

// What a current of 4-20 mA says about itself by NAMUR NE 43:
//
//   below failure_low            failure: bad after entry_samples in a row, until then held
//   up to measure_low            neither measurement nor failure: held, uncertain
//   up to 4 mA                   good, at the low limit
//   4 to 20 mA                   good
//   up to measure_high           good, at the high limit
//   up to failure_high           held, uncertain
//   above                        failure
//
// Bad is left only after recovery_s without a break between measure_low and measure_high. "Held"
// means that the sample before stands, with its own time: a held value grows old.
class Ne43 {
 public:
  explicit Ne43(const Ne43Settings& settings) noexcept : settings_(settings) {}

  struct Reading {
    Quality quality = Quality::bad;
    Reason reason = Reason::never_received;
    Limit limit = Limit::none;  // of the current; a reversed range turns it round
    bool fresh = false;         // the current is a measurement; false: hold the sample before
  };

  // What is not a number counts as a failure current.
  Reading step(double current_ma, std::int64_t time_ns) noexcept;

  // There was no reading: what follows does not adjoin what went before.
  void interrupted() noexcept { recovering_ = false; }

 private:
  Ne43Settings settings_;
  int failures_ = 0;  // in a row
  bool bad_ = false;
  bool measured_ = false;  // there is something to hold
  bool recovering_ = false;
  std::int64_t recovering_since_ns_ = 0;
};

}  // namespace loopwarden::hal::iio
