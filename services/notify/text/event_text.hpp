// SPDX-License-Identifier: Apache-2.0
// What people and programs read of events and messages.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "services/notify/rules/message.hpp"

namespace date {
class time_zone;
}

namespace loopwarden::notify {

// How texts name the box and the time.
struct Sender {
  std::string box;
  const date::time_zone* zone = nullptr;  // of times in texts for people
  std::string page_url{};  // of the box's page, without a slash at the end; empty if there is none
};

std::string rfc3339(std::int64_t utc_ms);  // 2026-11-24T07:00:00.123Z
// "2026-11-24 08:00:00 +0100"
std::string local_time(std::int64_t utc_ms, const date::time_zone& zone);

// "Low air supply": an alarm as people call it, as on the page.
std::string alarm_words(const std::string& alarm);
// Of a message of at most so many events each alarm is told with why and what to do.
inline constexpr std::size_t kMostGuided = 5;

// "FIC-101 (cooling water): Stiction"
std::string subject_of(const Event& event);
// "FIC-101 (cooling water): Stiction came, 6.1 %": without the time, unless it is told long after it came.
std::string sentence(const Event& event, const Sender& sender);
// One line for the whole message: of one event its sentence, of several their numbers.
std::string headline(const Message& message, const Sender& sender);
// Where the page shows the alarm or its incident; it holds nothing secret. Empty: no page is configured, or it is no loop's.
std::string page_of(const Event& event, const Sender& sender);
// Text of several lines, each ending with \n: all events that are listed and, of few, what to do.
std::string letter(const Message& message, const Sender& sender);

nlohmann::json to_json(const Event& event);
Event event_from(const nlohmann::json& json);

// The least of the syslog and journal priorities (0 emergency ... 7 debug) that fits: 3 where valves or the daemon need
// somebody now, 4 warning, 5 notice.
int priority_of(const Event& event);

// As a line of JSON; what is no UTF-8 is replaced.
std::string dump(const nlohmann::json& json);

}  // namespace loopwarden::notify
