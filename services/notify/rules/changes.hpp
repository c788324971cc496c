// SPDX-License-Identifier: Apache-2.0
// From what an alarm was to what it is: which of it is to be told. The states are those of the daemon
// (model/alarm/alarm.hpp), read once a second: what came and went in between is seen by the number of times that the
// alarm was raised.
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
  std::int64_t raised_ms = 0;    // when its condition came last; 0: not known
  std::int64_t changed_ms = 0;   // when its state or shelf changed last; 0: not known
  std::string description{};     // of the loop
  std::string incident{};        // that it belongs to; empty: none
  std::int64_t incident_ms = 0;  // when that one opened
  std::string area{};            // of the loop
  std::string priority{};
  std::string why{};  // what explains it; empty: nothing does
  std::string action{};
  std::string time_to_act{};
  std::string incident_says{};  // the incident's name, and how sure its explanation is
};

// An alarm as it was told last. Survives a restart.
struct AlarmPicture {
  std::string state = "normal";
  bool unacknowledged = false;
  std::int64_t times_raised = 0;
  std::optional<double> worst_percent{};  // since it came
  std::int64_t since_ms = 0;              // when it came, or became so severe that more are told
  std::int64_t reminded_ms = 0;           // what fell due until then was told

  friend bool operator==(const AlarmPicture&, const AlarmPicture&) = default;
};

// What happened to the alarm, with all that the reading says of it.
Event event_of_reading(const AlarmReading& reading, const AlarmPicture& picture, Change change,
                       std::int64_t utc_ms, std::int64_t noticed_ms);

// Told as being there: neither off, nor shelved, nor the consequence of another.
bool is_told(const std::string& state) noexcept;

// Of an alarm that was never seen before: what is there is news, what has gone is not.
AlarmPicture first_picture(const AlarmReading& reading);

// An event that has waited, with what is known by now: why, what to do, how large. Where its incident has got a name
// meanwhile, it is told by the alarm of that name.
void bring_up_to_date(Event& event, std::span<const AlarmReading> readings);

// Changes in the order in which they happened, each with the daemon's time of it; `picture` becomes what was read.
std::vector<Event> take_changes(AlarmPicture& picture, const AlarmReading& reading,
                                std::int64_t now_ms);

}  // namespace loopwarden::notify
