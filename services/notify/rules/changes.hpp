// SPDX-License-Identifier: Apache-2.0
// Derives the changes to report from the former and the present state of an alarm. The states are
// those of the daemon (model/alarm/alarm.hpp), read once a second. The count of raises reveals
// changes between two readings.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/notify/rules/event.hpp"

namespace loopwarden::notify {

struct AlarmReading {
  AlarmKey key;
  std::string state;
  bool unacknowledged = false;  // waits for the operator
  std::int64_t times_raised = 0;
  std::optional<double> severity_percent{};
  std::int64_t raised_ms = 0;    // when its condition was last raised; 0: not known
  std::int64_t changed_ms = 0;   // when its state or shelf changed last; 0: not known
  std::string description{};     // of the loop
  std::string incident{};        // that it belongs to; empty: no incident
  std::int64_t incident_ms = 0;  // when that one opened
  std::string incident_name{};
  std::string area{};  // of the loop
  std::string priority{};
  std::string why{};  // explanation; empty: not explained
  std::string consequence{};
  std::string action{};
  std::string time_to_act{};
  std::string incident_says{};  // the incident's name, and how sure its explanation is
};

// An alarm as last reported. Survives a restart.
struct AlarmPicture {
  std::string state = "normal";
  bool unacknowledged = false;
  std::int64_t times_raised = 0;
  std::optional<double> worst_percent{};  // since it was raised
  // When it was raised, or became so severe that more channels report it.
  std::int64_t since_ms = 0;
  std::int64_t reminded_ms = 0;  // reminders due until then were sent

  friend bool operator==(const AlarmPicture&, const AlarmPicture&) = default;
};

// Returns the event of a change, with all data of the reading.
Event event_of_reading(const AlarmReading& reading, const AlarmPicture& picture, Change change,
                       std::int64_t utc_ms, std::int64_t noticed_ms);

// Returns whether an alarm in this state is reported as active: neither off, nor shelved, nor the
// consequence of another.
bool is_told(const std::string& state) noexcept;

// Returns the picture before the first reading of an alarm. An active alarm is then news, a cleared
// one is not.
AlarmPicture first_picture(const AlarmReading& reading);

// Updates an event that has waited with the newest explanation, action and size. If its incident
// was named meanwhile, the alarm of that name replaces the event's.
void bring_up_to_date(Event& event, std::span<const AlarmReading> readings);

// Returns the changes in the order in which they happened, each with the daemon's time. `picture`
// becomes the state that was read.
std::vector<Event> take_changes(AlarmPicture& picture, const AlarmReading& reading,
                                std::int64_t now_ms);

}  // namespace loopwarden::notify
