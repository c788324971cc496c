// SPDX-License-Identifier: Apache-2.0
// Constants that decide alarms, incidents and corrective action. The limits of PV are settings
// (limit_watch.hpp). Source: chosen by hand, unless a line or a section names another.
// `loopwarden-study alarm` measures the windows for an alarm. No study measures the others.
#pragma once

#include <cstddef>
#include <cstdint>

namespace loopwarden::alarm {

struct AlarmLimits {
  // Figures (ANSI/ISA-18.2-2016).
  static constexpr std::int64_t kStretch_ms = 600'000;  // interval of a flood
  static constexpr std::size_t kFloodBegins = 10;       // alarms per interval: more
  static constexpr std::size_t kFloodEnds = 5;          // alarms per interval: fewer
  static constexpr std::size_t kChatters = 3;           // within kChatter_ms
  static constexpr std::int64_t kChatter_ms = 60'000;
  static constexpr std::int64_t kStale_ms = 24LL * 3'600'000;
  static constexpr std::size_t kTop = 10;  // most frequent alarms

  // Process and box alarms (EEMUA 191, chapter 8; the on-delays are own).
  static constexpr double kProcessDelay_s = 10.0;  // default on-delay
  static constexpr std::int64_t kProcessDelay_ms =
      static_cast<std::int64_t>(1000.0 * kProcessDelay_s);
  static constexpr double kDeviationDelay_s = 60.0;  // default on-delay
  static constexpr double kOffDelay_s = 60.0;        // default; then flapping has ended
  static constexpr std::int64_t kOffDelay_ms = static_cast<std::int64_t>(1000.0 * kOffDelay_s);
  static constexpr std::uint32_t kFlaps = 5;                  // number that raises the alarm
  static constexpr std::int64_t kServiceRestart_ms = 30'000;  // on-delay: a service restarts itself
  static constexpr double kFirstValues_s = 30.0;  // a feeder connects and sends its first values
  static constexpr double kSetPointMoves = 0.1;   // of the limit of the deviation

  // Name of an alarm and of its incident.
  static constexpr double kSureName = 0.9;           // confidence
  static constexpr double kSureClosed = 0.8;         // of the gap
  static constexpr double kStickSeen_percent = 1.0;  // of the CO span
  static constexpr std::int64_t kJoin_ms = 40LL * 60 * 1000;
  static constexpr std::int64_t kQuiet_ms = 30LL * 60 * 1000;

  // Windows for an alarm: N of M (EEMUA 191, chapter 8; the numbers are own). A valve that sticks
  // looks healthy while the loop doesn't cross the stick band, so a repair needs more windows.
  static constexpr std::size_t kWindows = 5;          // M
  static constexpr std::size_t kWindowsOn = 3;        // N
  static constexpr std::size_t kWindowsOff = 1;       // of kWindowsToClear, to clear
  static constexpr std::size_t kWindowsToClear = 15;  // twelve minutes
  static constexpr double kProbabilityOn = 0.5;
  static constexpr double kProbabilityOff = 0.3;

  // Measures of a window.
  static constexpr double kResolution_percent = 0.2;  // of the CO span: least move

  // Corrective action. A window adds 48 s with the daemon's overlap. The cycle of a sticky loop
  // lasts minutes, and the dwell form makes it several times as long.
  static constexpr std::size_t kBaseline = 16;  // windows: 13 minutes
  static constexpr std::size_t kSettling = 8;   // windows: 6 minutes
  static constexpr std::size_t kTrial = 40;     // windows: 32 minutes
  static constexpr double kLeastGain = 0.05;    // of R
  static constexpr double kShadow_s = 600.0;
  static constexpr std::size_t kLeastBaseline = 4;     // steady windows in shadow
  static constexpr int kMostDisengaged = 3;            // planned moves, per explanation
  static constexpr double kStandsStill_percent = 0.1;  // of the PV span: SP is steady
};
using Limits = AlarmLimits;  // in this folder

}  // namespace loopwarden::alarm
