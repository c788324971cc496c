// SPDX-License-Identifier: Apache-2.0
#include "services/notify/text/event_text.hpp"

#include <date/tz.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "base/text.hpp"
#include "model/alarm/alarm_guide.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::notify {
namespace {

using nlohmann::json;

date::sys_time<std::chrono::milliseconds> time_of(std::int64_t utc_ms) {
  return date::sys_time<std::chrono::milliseconds>{std::chrono::milliseconds(utc_ms)};
}

std::string daemon_sentence(const Event& event) {
  if (event.change == Change::went) return "loopwardend responds again";
  if (event.change == Change::unacknowledged)
    return fmt::format("loopwardend has not responded for {} min", event.waits_min);
  return "loopwardend does not respond, so no alarms are raised";
}

// Alarms are reported within seconds, unless the program or the daemon was away.
constexpr std::int64_t kLate = kMinute;

// Returns "anna" of "anna@10.0.0.5 by page (uid 997)". A peer without a name is returned unchanged.
std::string person_of(const std::string& peer) {
  const std::size_t at = peer.find('@');
  return at < peer.find(" by ") ? peer.substr(0, at) : peer;
}

std::string what_happened(const Event& event, const Sender& sender) {
  if (event.change == Change::unacknowledged)
    return fmt::format("not acknowledged for {} min", event.waits_min);
  if (event.change == Change::came && event.noticed_ms - event.utc_ms >= kLate)
    return fmt::format("alarm, active since {}", local_time(event.utc_ms, *sender.zone));
  return event.change == Change::came   ? "alarm"
         : event.change == Change::went ? "cleared"
                                        : to_text(event.change);
}

// Returns links to all alarms of the message, or to the page itself if they are many.
std::string links(const Message& message, const Sender& sender) {
  if (sender.page_url.empty()) return "";
  std::vector<std::string> told;
  for (const Event& event : message.events) {
    const std::string link = page_of(event, sender);
    const bool known = std::find(told.begin(), told.end(), link) != told.end();
    if (!link.empty() && !known) told.push_back(link);
  }
  if (told.empty() || message.events.size() > kMostGuided) told = {sender.page_url + "/"};
  std::string text = "\n";
  for (const std::string& link : told) text += link + "\n";
  return text;
}

// Returns " on FIC-101 and FIC-102", for example, if they are few.
std::string few_loops(const Message& message) {
  constexpr std::size_t kFew = 3;
  std::vector<std::string> loops;
  for (const Event& event : message.events) {
    if (std::find(loops.begin(), loops.end(), event.loop) == loops.end())
      loops.push_back(event.loop);
  }
  const bool all = message.count() == static_cast<std::int64_t>(message.events.size());
  if (!all || loops.size() > kFew) return "";
  std::string text;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    text += i == 0 ? " on " : i + 1 < loops.size() ? ", " : " and ";
    text += loops[i].empty() ? "the daemon" : loops[i];
  }
  return text;
}

// Returns the count of each change in words.
std::string counted(const Message& message) {
  constexpr std::array kCounted{"new", "cleared", "acknowledged", "shelved", "not acknowledged"};
  std::string text;
  for (std::size_t i = 0; i < message.counts.size(); ++i) {
    if (message.counts.at(i) == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", message.counts.at(i), kCounted.at(i));
  }
  return text;
}

template <class Kinds>
auto named(const Kinds& kinds, const std::string& alarm) {
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](auto one) { return alarm == alarm::to_text(one); });
  return found == kinds.end() ? std::nullopt : std::optional(*found);
}

struct Usual {
  alarm::AlarmGuide guide;
  alarm::Priority priority;
};

// Returns guide and priority of an alarm of a loop or of the box; nullopt if the alarm is unknown.
std::optional<Usual> usual_of(const std::string& alarm) {
  if (const auto kind = named(alarm::kAlarmKinds, alarm)) {
    return Usual{alarm::guide_of(*kind), alarm::usual_priority(*kind)};
  }
  if (const auto kind = named(alarm::kBoxAlarms, alarm)) {
    return Usual{alarm::guide_of(*kind), alarm::usual_priority(*kind)};
  }
  return std::nullopt;
}

// Returns the details of one alarm: place, time, size, explanation, action.
std::string details(const Event& event, const Sender& sender) {
  const std::optional<Usual> usual = usual_of(event.alarm);
  if (!usual) return "";
  const alarm::AlarmGuide& guide = usual->guide;
  std::string text = fmt::format("\n{} {}\n", event.loop, alarm_words(event.name()));
  const auto line = [&](const char* what, const std::string& value) {
    if (!value.empty()) text += fmt::format("  {:<15} {}\n", what, value);
  };
  const auto said = [](const std::string& own, const char* otherwise) {
    return own.empty() ? std::string(otherwise) : own;
  };
  if (event.change == Change::came) line("Since:", local_time(event.utc_ms, *sender.zone));
  line("Area:", event.area);
  line("Priority:", event.priority);
  if (event.severity_percent && event.name() == event.alarm) {
    line("Size:", fmt::format("{:.1f} % of CO span", *event.severity_percent));
  }
  line("Cause:", said(event.why, guide.cause));
  line("Consequence:", said(event.consequence, guide.consequence));
  line("Action:", said(event.action, guide.action));
  line("Respond within:", said(event.time_to_act, guide.time_to_act));
  return text;
}

// Returns the guide of each alarm that requires an action, each once.
std::string guides(const Message& message, const Sender& sender) {
  std::set<AlarmKey> told;
  std::string text;
  for (const Event& event : message.events) {
    const bool asks = event.change == Change::came || event.change == Change::unacknowledged;
    if (asks && told.insert({event.loop, event.alarm}).second) text += details(event, sender);
  }
  return text;
}

json number(std::optional<double> value) { return value ? json(*value) : json(nullptr); }

std::optional<double> number_from(const json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

Change change_from(const std::string& text) {
  for (const Change change : {Change::came, Change::went, Change::acknowledged, Change::shelved}) {
    if (text == to_text(change)) return change;
  }
  return Change::unacknowledged;
}

}  // namespace

std::string rfc3339(std::int64_t utc_ms) { return date::format("%FT%TZ", time_of(utc_ms)); }

std::string local_time(std::int64_t utc_ms, const date::time_zone& zone) {
  const auto seconds = date::floor<std::chrono::seconds>(time_of(utc_ms));
  return date::format("%F %T %z", date::make_zoned(&zone, seconds));
}

std::string alarm_words(const std::string& alarm) {
  static const std::map<std::string, std::string> kWords{
      {"unknown", "Unknown valve fault"},
      {"model_gap", "No longer as commissioned"},
      {"bad_pv", "PV bad"},
      {"output_unknown", "Output position unknown"},
      {"not_normal_mode", "Not in its normal mode"},
      {"deviation", "PV deviates from set point"},
      {"pv_high_high", "PV far too high"},
      {"pv_high", "PV high"},
      {"pv_low", "PV low"},
      {"pv_low_low", "PV far too low"},
      {"rate_of_change", "PV changes too fast"},
      {"clock_stepped", "Clock of the box changed"},
      {"service_failed", "Service failed"},
      {"certificate_expires", "Certificate expires soon"},
      {"records_dropped", "Samples missing in records"},
      {"disk_writes", "More disk writes than the budget"},
      {"connection_lost", "Connection lost"}};
  const auto known = kWords.find(alarm);
  if (known != kWords.end() || alarm.empty()) return known == kWords.end() ? "" : known->second;
  std::string words = base::in_words(alarm);
  if (words[0] >= 'a' && words[0] <= 'z') words[0] = static_cast<char>(words[0] - 'a' + 'A');
  return words;
}

std::string page_of(const Event& event, const Sender& sender) {
  if (sender.page_url.empty() || event.loop.empty()) return "";
  return fmt::format("{}/#/alarms/{}/{}", sender.page_url, base::percent_encoded(event.loop),
                     base::percent_encoded(event.of_incident ? "incident" : event.alarm));
}

std::string subject_of(const Event& event) {
  const std::string about =
      event.description.empty() ? "" : fmt::format(" ({})", event.description);
  return fmt::format("{}{}: {}", event.loop, about, alarm_words(event.name()));
}

std::string sentence(const Event& event, const Sender& sender) {
  if (event.alarm == kDaemonAlarm) return daemon_sentence(event);
  std::string text = fmt::format("{} {}", subject_of(event), what_happened(event, sender));
  // A size belongs to the alarm's name only.
  if (event.severity_percent && event.name() == event.alarm)
    text += fmt::format(", {:.1f} % of CO span", *event.severity_percent);
  if (!event.peer.empty()) text += fmt::format(", by {}", person_of(event.peer));
  if (!event.reason.empty()) text += fmt::format(" ({})", event.reason);
  return text;
}

std::string headline(const Message& message, const Sender& sender) {
  if (message.test) return fmt::format("[{}] test of channel {}", sender.box, message.channel);
  if (message.count() == 1) {
    return fmt::format("[{}] {}", sender.box, sentence(message.events.front(), sender));
  }
  return fmt::format("[{}] {} alarm changes{}: {}", sender.box, message.count(), few_loops(message),
                     counted(message));
}

std::string letter(const Message& message, const Sender& sender) {
  std::string text = headline(message, sender) + "\n\n";
  for (const Event& event : message.events) {
    text +=
        fmt::format("{}  {}\n", local_time(event.utc_ms, *sender.zone), sentence(event, sender));
  }
  const auto listed = static_cast<std::int64_t>(message.events.size());
  if (message.count() > listed) text += fmt::format("... and {} more\n", message.count() - listed);
  if (message.lost > 0)
    text += fmt::format("{} older events were dropped because the queue was full\n", message.lost);
  if (message.perhaps_twice) text += "This message may be a duplicate.\n";
  if (message.events.size() <= kMostGuided) text += guides(message, sender);
  text += links(message, sender);
  return text + fmt::format("\n-- \nloopwarden-notify on {}, message {}\n", sender.box, message.id);
}

json to_json(const Event& event) {
  return {{"utc_ms", event.utc_ms},
          {"loop", event.loop},
          {"alarm", event.alarm},
          {"change", to_text(event.change)},
          {"state", event.state},
          {"severity_percent", number(event.severity_percent)},
          {"worst_severity_percent", number(event.worst_percent)},
          {"waits_min", event.waits_min},
          {"peer", event.peer},
          {"reason", event.reason},
          {"description", event.description},
          {"noticed_ms", event.noticed_ms},
          {"area", event.area},
          {"priority", event.priority},
          {"of_incident", event.of_incident},
          {"incident_name", event.incident_name},
          {"why", event.why},
          {"consequence", event.consequence},
          {"action", event.action},
          {"time_to_act", event.time_to_act}};
}

Event event_from(const json& json) {
  return {.utc_ms = json.at("utc_ms").get<std::int64_t>(),
          .loop = json.at("loop").get<std::string>(),
          .alarm = json.at("alarm").get<std::string>(),
          .change = change_from(json.at("change").get<std::string>()),
          .state = json.at("state").get<std::string>(),
          .severity_percent = number_from(json.at("severity_percent")),
          .worst_percent = number_from(json.at("worst_severity_percent")),
          .waits_min = json.at("waits_min").get<std::int64_t>(),
          .peer = json.at("peer").get<std::string>(),
          .reason = json.at("reason").get<std::string>(),
          .description = json.value("description", std::string()),
          .noticed_ms = json.value("noticed_ms", std::int64_t{0}),
          .area = json.value("area", std::string()),
          .priority = json.value("priority", std::string()),
          .of_incident = json.value("of_incident", false),
          .incident_name = json.value("incident_name", std::string()),
          .why = json.value("why", std::string()),
          .consequence = json.value("consequence", std::string()),
          .action = json.value("action", std::string()),
          .time_to_act = json.value("time_to_act", std::string())};
}

int priority_of(const Event& event) {
  constexpr int kError = 3;
  constexpr int kWarning = 4;
  constexpr int kNotice = 5;
  if (event.change == Change::unacknowledged) return kError;
  if (event.change != Change::came) return kNotice;
  const std::optional<Usual> usual = usual_of(event.alarm);
  const std::string priority =
      !event.priority.empty() || !usual ? event.priority : alarm::to_text(usual->priority);
  const bool now = event.alarm == kDaemonAlarm || priority == "high" || priority == "critical";
  return now ? kError : kWarning;
}

std::string dump(const json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace loopwarden::notify
