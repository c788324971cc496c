// SPDX-License-Identifier: Apache-2.0
// An event to report: an alarm of a loop, or the daemon itself, has changed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace loopwarden::notify {

// The name under which "the daemon does not answer" is an alarm like others. It belongs to no loop.
inline constexpr const char* kDaemonAlarm = "daemon";

inline constexpr std::int64_t kMinute = 60'000;  // ms

enum class Change : std::uint8_t { came, went, acknowledged, shelved, unacknowledged };
inline constexpr std::size_t kRoutedChanges = 4;  // the first of them; the last is a reminder

constexpr const char* to_text(Change change) noexcept {
  switch (change) {
    case Change::came: return "came";
    case Change::went: return "went";
    case Change::acknowledged: return "acknowledged";
    case Change::shelved: return "shelved";
    case Change::unacknowledged: break;
  }
  return "unacknowledged";
}

// Loop and alarm; the loop is empty for the daemon itself.
using AlarmKey = std::pair<std::string, std::string>;

struct Event {
  std::int64_t utc_ms = 0;  // when it happened
  std::string loop{};
  std::string alarm{};
  Change change = Change::came;
  std::string state{};                       // of the alarm, as the daemon calls it
  std::optional<double> severity_percent{};  // % of the CO span; nullopt if the alarm has no size
  std::optional<double> worst_percent{};     // the largest since it was raised
  std::int64_t waits_min = 0;                // of a reminder: time without acknowledgement
  std::string peer{};                        // who acknowledged or shelved it
  std::string reason{};
  std::string description{};    // of the loop
  std::int64_t noticed_ms = 0;  // when it was read from the daemon; 0: at once
  std::string area{};           // of the loop
  std::string priority{};       // low, medium, high, critical; empty: not known
  bool of_incident = false;     // others may belong to the same one
  std::string
      incident_name{};        // the name on the page: of an effect or an alarm; empty: the alarm's
  std::string why{};          // explanation, if there is one
  std::string consequence{};  // of not acting; empty: as the guide
  std::string action{};       // what to do, as the loop's file has it; empty: as the guide
  std::string time_to_act{};

  // Returns the one name of the fault: that of its incident, or of the alarm.
  const std::string& name() const noexcept { return incident_name.empty() ? alarm : incident_name; }

  friend bool operator==(const Event&, const Event&) = default;
};

}  // namespace loopwarden::notify
