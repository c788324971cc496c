// SPDX-License-Identifier: Apache-2.0
// Whether PV is where it should not be: the limits of a loop's process alarms, with their dead bands.
//
//   deviation               |SP - PV| > limit, in automatic, once `settle_s` has passed since the set point last moved and
//                           since the loop last came into automatic. A set point moves when it is more than a tenth of the
//                           limit away from where it last stood, so a ramp moves it all the way
//   pv_high_high, pv_high   PV > limit
//   pv_low, pv_low_low      PV < limit
//   rate_of_change          |(PV - PV'')/T| > limit, PV'' being PV behind a first-order lag of T = `rate_time_s`: of a ramp
//                           its slope
//
// What was beyond a limit is within it again once it is `dead_band` inside.
//
// Symbols: SP, PV, limit, dead_band in PV units, of rate_of_change in PV units/s; times in s. Stepped once a cycle. No
// clock, no allocation.
//
// Errors: none; of a PV that is bad nothing is said, and of a set point that is not known no deviation.
// What it can't do: limits that follow the load or the state of the plant.
//
// Source: dead bands and delays as in ANSI/ISA-18.2-2016 (basic alarm design) and EEMUA 191 (2013), chapter 8.
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

  // Bad PV: NaN.
  void add(std::uint64_t period, double sp, double pv, bool automatic) noexcept;

  // The deviation is not looked at: it counts as off.
  bool rests() const noexcept { return rests_; }
  // `was`: beyond it in the cycle before. Nothing: the cycle can't tell.
  std::optional<bool> beyond(AlarmKind kind, bool was) const noexcept;

 private:
  void watch_set_point(std::uint64_t period, double sp, bool automatic) noexcept;
  void watch_rate(std::uint64_t period, double pv) noexcept;

  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double sample_time_s_;
  LimitSettings settings_;
  double sp_ = kNone;
  double pv_ = kNone;
  double sp_stood_ = kNone;  // where SP last stood
  std::optional<std::uint64_t> moved_;
  bool rests_ = true;
  double lagged_ = kNone;  // PV''
  double rate_ = kNone;    // PV units/s
  std::uint64_t rate_period_ = 0;
};

}  // namespace loopwarden::alarm
