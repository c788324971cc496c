// SPDX-License-Identifier: Apache-2.0
// Texts of events and messages, for people and programs.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "services/notify/rules/message.hpp"

namespace date {
class time_zone;
}

namespace loopwarden::notify {

// The names of the box and the time zone in texts.
struct Sender {
  std::string box;
  const date::time_zone* zone = nullptr;  // of times in texts for people
  std::string page_url{};  // of the box's page, without a slash at the end; empty if not configured
};

std::string rfc3339(std::int64_t utc_ms);  // 2026-11-24T07:00:00.123Z
// "2026-11-24 08:00:00 +0100"
std::string local_time(std::int64_t utc_ms, const date::time_zone& zone);

// Returns "Low air supply", for example: an alarm's name as on the page.
std::string alarm_words(const std::string& alarm);
// A message of at most this many events explains each alarm and its action.
inline constexpr std::size_t kMostGuided = 5;

// Returns "FIC-101 (cooling water): Stiction", for example.
std::string subject_of(const Event& event);
// Returns "FIC-101 (cooling water): Stiction alarm, 6.1 % of CO span", for example. The time
// follows only if the report is late.
std::string sentence(const Event& event, const Sender& sender);
// Returns one line for the whole message: the sentence of a single event, or the counts of several.
std::string headline(const Message& message, const Sender& sender);
// Returns the page's address of the alarm or its incident; it contains no secret. Empty if no page
// is configured or the event belongs to no loop.
std::string page_of(const Event& event, const Sender& sender);
// Returns lines that end with \n: all listed events and, if they are few, the actions.
std::string letter(const Message& message, const Sender& sender);

nlohmann::json to_json(const Event& event);
Event event_from(const nlohmann::json& json);

// Returns the syslog and journal priority (0 emergency ... 7 debug): 3 if valves or the daemon need
// a person now, 4 warning, 5 notice.
int priority_of(const Event& event);

// Returns one line of JSON. Bytes that are not UTF-8 are replaced.
std::string dump(const nlohmann::json& json);

}  // namespace loopwarden::notify
