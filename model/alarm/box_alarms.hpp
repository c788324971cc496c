// SPDX-License-Identifier: Apache-2.0
// The alarms of the box itself: the group `box`. Their states are those of all alarms (alarm.hpp).
//
//   disk_full            the state directory has little room, the journal can't write, or the disk
//                        hangs
//   clock_stepped        the clock was set by more than a second: times in records and journal jump
//   feeder_lost          a feeder of watched loops is not connected
//   service_failed       a service of the box has died
//   certificate_expires  a certificate ends within 14 days
//   records_dropped      recorder or monitor was too slow, and cycles are missing in records or
//                        windows
//   disk_writes          the daemon writes more per day than its budget
//   connection_lost      a link, device, edge node, broker or server of loops is lost. It is
//                        raised again if another one is lost
//
// A condition is raised after it was found without a break for its on-delay. It clears after it was
// absent for kOffDelay_ms. A finding without a value leaves the condition as it is and restarts
// the delay.
//
// Errors: an action that doesn't fit the state is refused and leaves the state as it is.
// Limits: it can't report a box that is off, or the end of the daemon itself.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682): alarms of the system's own diagnosis.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "model/alarm/alarm.hpp"
#include "model/alarm/alarm_guide.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/limits.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The tag of the box in places where alarms have a loop. No loop may have this tag.
inline constexpr const char* kBox = "box";

// The order is that of the register's bits and never changes.
enum class BoxAlarm : std::uint8_t {
  disk_full,
  clock_stepped,
  feeder_lost,
  service_failed,
  certificate_expires,
  records_dropped,
  disk_writes,
  connection_lost
};
inline constexpr std::array kBoxAlarms{BoxAlarm::disk_full,           BoxAlarm::clock_stepped,
                                       BoxAlarm::feeder_lost,         BoxAlarm::service_failed,
                                       BoxAlarm::certificate_expires, BoxAlarm::records_dropped,
                                       BoxAlarm::disk_writes,         BoxAlarm::connection_lost};
inline constexpr std::size_t kBoxAlarmCount = kBoxAlarms.size();

constexpr std::size_t index_of(BoxAlarm kind) noexcept { return static_cast<std::size_t>(kind); }
constexpr const char* to_text(BoxAlarm kind) noexcept {
  return numeric::enum_name<BoxAlarm::connection_lost>(
      kind, {"disk_full", "clock_stepped", "feeder_lost", "service_failed", "certificate_expires",
             "records_dropped", "disk_writes", "connection_lost"});
}
constexpr Priority usual_priority(BoxAlarm kind) noexcept {
  if (kind == BoxAlarm::disk_writes) return Priority::low;
  const bool high = kind == BoxAlarm::disk_full || kind == BoxAlarm::connection_lost;
  return high ? Priority::high : Priority::medium;
}
AlarmGuide guide_of(BoxAlarm kind) noexcept;

// Returns the on-delay. A service that restarts by itself has time to do so.
constexpr std::int64_t on_delay_ms(BoxAlarm kind) noexcept {
  if (kind == BoxAlarm::connection_lost) return Limits::kProcessDelay_ms;
  return kind == BoxAlarm::feeder_lost || kind == BoxAlarm::service_failed
             ? Limits::kServiceRestart_ms
             : 0;
}

// The findings of one look at the box; an empty value if the state is not known.
using BoxFindings = std::array<std::optional<bool>, kBoxAlarmCount>;

class BoxAlarms {
 public:
  explicit BoxAlarms(const AlarmSettings& settings) noexcept;
  void restore(BoxAlarm kind, const AlarmMemory& memory) noexcept;

  // Passes the findings on to the alarms. `monotonic_ms` is for the delays, `utc_ms` for the
  // alarms. Returns true if an alarm changed.
  bool found(const BoxFindings& findings, std::int64_t monotonic_ms, std::int64_t utc_ms) noexcept;
  // Raises an active alarm again, because its condition has a further cause.
  void raise_again(BoxAlarm kind, std::int64_t utc_ms) noexcept;
  bool act(BoxAlarm kind, AlarmAction action, std::int64_t utc_ms, std::int64_t until_ms) noexcept;

  const Alarm& alarm(BoxAlarm kind) const noexcept { return alarms_[index_of(kind)]; }
  // Returns the bits of the alarms whose condition is on.
  unsigned active() const noexcept;

 private:
  struct Delayed {
    bool on = false;
    std::optional<std::int64_t> other_since_ms;
  };
  std::array<Alarm, kBoxAlarmCount> alarms_;
  std::array<Delayed, kBoxAlarmCount> conditions_{};
};

}  // namespace loopwarden::alarm
