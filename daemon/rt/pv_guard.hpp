// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "hal/contract/pv_check_settings.hpp"
#include "hal/contract/sample.hpp"
#include "model/control/pid.hpp"

namespace loopwarden::daemon::rt {

// Returns `sample`, with quality bad if its value is not finite, or outside of `low` to `high` by
// more than `margin` of that span. Devices and gateways have many codes for "no value": NaN, the
// largest float, 0x8000, 0x7FFF, 0xFFFF, -9999. They are outside of every range that does not
// contain them as a value.
hal::Sample in_range(hal::Sample sample, double low, double high, double margin) noexcept;

// The same for a signal in PV units (PV, SP) and in CO units (CO, stem). The margin for CO and stem
// is at least kOutputMargin, because a closed valve reads a little below 0 %.
inline constexpr double kOutputMargin = 0.05;  // share of the CO span
hal::Sample checked_as_pv(hal::Sample sample, const hal::PvCheckSettings& pv) noexcept;
hal::Sample checked_as_output(hal::Sample sample, const hal::PvCheckSettings& pv,
                              const control::PidSettings& pid) noexcept;

// Checks the newest sample of PV: its age, that it is a number, inside the range, and not frozen.
//
// PV is frozen when it has repeated one value exactly, CO has moved by kFrozenMove of its span
// since PV last changed (highest - lowest CO), and PV has still not changed frozen_after_s later,
// or kRests times the rest that is usual for this PV, but at most kLongestWait_s. It stays frozen
// until it changes. The usual rest is the longest of the last changes (older ones count less,
// kForget per change); PVs with a coarse resolution and PVs that are reported on change rest for
// long.
//
// Movement of CO counts only in automatic: in manual a line may be shut and a process out of
// service. A PV at an end of its range (kAtEnd) may be clipped, or be the zero of a line without
// flow, and is never frozen.
// Limits: a frozen PV is not detected while CO rests, or at an end of the range. A PV of coarse
// resolution that a controller keeps within one step while CO moves by kFrozenMove looks frozen.
class PvGuard {
 public:
  static constexpr double kFrozenMove = 0.1;        // share of the CO span
  static constexpr double kAtEnd = 0.01;            // share of the PV span
  static constexpr double kRests = 3.0;             // usual rests
  static constexpr double kForget = 0.99;           // per change of PV
  static constexpr double kLongestWait_s = 3600.0;  // s

  explicit PvGuard(const hal::PvCheckSettings& settings) noexcept : settings_(settings) {}

  void configure(const hal::PvCheckSettings& settings) noexcept { settings_ = settings; }

  struct Output {
    double value = std::numeric_limits<double>::quiet_NaN();  // CO units; NaN: not known
    double span = 100.0;                                      // CO units
    bool automatic = true;
  };
  // Returns the sample, with a lower quality if a check fails. A frozen PV is uncertain.
  hal::Sample check(hal::Sample sample, const Output& output, std::int64_t now_ns) noexcept;

  // The position of the output was wrong by `difference`, CO units. This is no movement to which PV
  // would respond.
  void output_learned(double difference) noexcept;

 private:
  hal::Sample judged(hal::Sample sample, const Output& output, std::int64_t now_ns) noexcept;
  bool frozen(const hal::Sample& sample, const Output& output, std::int64_t now_ns) noexcept;
  bool at_end(const hal::Sample& sample) const noexcept;
  void changed(double value, std::int64_t now_ns) noexcept;
  void forget_movement(double output) noexcept;
  double wait_s() const noexcept;

  hal::PvCheckSettings settings_;
  bool seen_ = false;          // a value, ever
  double still_value_ = 0.0;   // PV units, since still_since_ns_
  double lowest_ = 0.0;        // CO units, since PV last changed; NaN: not known
  double highest_ = 0.0;       // CO units
  bool moved_ = false;         // CO, by kFrozenMove
  bool frozen_ = false;        // until PV changes
  double usual_rest_s_ = 0.0;  // s
  std::int64_t still_since_ns_ = 0;
  std::int64_t moved_at_ns_ = 0;
  // Time and movement of CO don't count while PV has no value.
  bool blind_ = false;
  std::int64_t blind_since_ns_ = 0;
  double output_when_blind_ = 0.0;  // CO units
};

}  // namespace loopwarden::daemon::rt
