// SPDX-License-Identifier: Apache-2.0
// Checks PV against the limits of a loop's process alarms, with their dead bands.
//
//   deviation               |SP - PV| > limit, in automatic, at least `settle_s` after the last
//                           move of the set point and after the loop's return to automatic. A set
//                           point moves if it differs from its last resting value by more than a
//                           tenth of the limit, so a ramp moves it all the time
//   pv_high_high, pv_high   PV > limit
//   pv_low, pv_low_low      PV < limit
//   rate_of_change          |(PV - PV'')/T| > limit; PV'' is PV after a first-order lag of T =
//                           `rate_time_s`. For a ramp this is its slope
//
// A value beyond a limit is within it again when it is `dead_band` inside.
//
// Symbols: SP, PV, limit, dead_band in PV units, of rate_of_change in PV units/s; times in s.
// Stepped once per cycle. No clock, no allocation.
//
// No errors. A bad PV gives no condition, and an unknown set point gives no deviation.
// Limits: it can't move a limit with the load or the state of the plant.
//
// Source: dead bands and delays as in ANSI/ISA-18.2-2016 (basic alarm design) and EEMUA 191 (2013),
// chapter 8.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "model/alarm/alarm_kind.hpp"

namespace loopwarden::alarm {

struct Limit {
  double limit = 0.0;
  double dead_band = 0.0;  // >= 0

  friend bool operator==(const Limit&, const Limit&) = default;
};

struct LimitSettings {
  std::array<Limit, kLimitAlarms.size()> of{};  // in the order of kLimitAlarms
  double settle_s = 0.0;                        // s, three time constants of the loop
  double rate_time_s = 10.0;                    // s, > 0

  Limit& at(AlarmKind kind) noexcept { return of[index_of(kind) - index_of(kLimitAlarms[0])]; }
  const Limit& at(AlarmKind kind) const noexcept {
    return of[index_of(kind) - index_of(kLimitAlarms[0])];
  }
  friend bool operator==(const LimitSettings&, const LimitSettings&) = default;
};

class LimitWatch {
 public:
  LimitWatch(double sample_time_s, const LimitSettings& settings) noexcept
      : sample_time_s_(sample_time_s), settings_(settings) {}

  // Adds a cycle. A bad PV is NaN.
  void add(std::uint64_t period, double sp, double pv, bool automatic) noexcept;

  // Returns whether the deviation is not checked at present. It counts as off then.
  bool rests() const noexcept { return rests_; }
  // Returns whether PV is beyond the limit; empty if the cycle doesn't show it. `was`: the result
  // of the cycle before.
  std::optional<bool> beyond(AlarmKind kind, bool was) const noexcept;

 private:
  void watch_set_point(std::uint64_t period, double sp, bool automatic) noexcept;
  void watch_rate(std::uint64_t period, double pv) noexcept;

  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double sample_time_s_;
  LimitSettings settings_;
  double sp_ = kNone;
  double pv_ = kNone;
  double sp_stood_ = kNone;  // last resting value of SP
  std::optional<std::uint64_t> moved_;
  bool rests_ = true;
  double lagged_ = kNone;  // PV''
  double rate_ = kNone;    // PV units/s
  std::uint64_t rate_period_ = 0;
};

}  // namespace loopwarden::alarm
