// SPDX-License-Identifier: Apache-2.0
#include "services/notify/text/event_text.hpp"

#include <date/tz.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "base/text.hpp"
#include "model/monitor/alarm_guide.hpp"
#include "model/monitor/alarm_kind.hpp"

namespace loopwarden::notify {
namespace {

using nlohmann::json;

// Of a message of at most so many events the remedies are told as well.
constexpr std::size_t kMostGuided = 5;

date::sys_time<std::chrono::milliseconds> time_of(std::int64_t utc_ms) {
  return date::sys_time<std::chrono::milliseconds>{std::chrono::milliseconds(utc_ms)};
}

std::string daemon_sentence(const Event& event) {
  if (event.change == Change::went) return "the daemon answers again";
  if (event.change == Change::unacknowledged)
    return fmt::format("the daemon has not answered for {} min", event.waits_min);
  return "the daemon does not answer: no loop is watched";
}

// An alarm is told within seconds, unless the program or the daemon was away.
constexpr std::int64_t kLate = kMinute;

std::string what_happened(const Event& event, const Sender& sender) {
  if (event.change == Change::unacknowledged)
    return fmt::format("not acknowledged for {} min", event.waits_min);
  if (event.change == Change::came && event.noticed_ms - event.utc_ms >= kLate)
    return fmt::format("is there since {}", local_time(event.utc_ms, *sender.zone));
  return to_text(event.change);
}

// Of all loops of the message, or the page itself where they are many.
std::string links(const Message& message, const Sender& sender) {
  if (sender.page_url.empty()) return "";
  std::set<std::string> told;
  for (const Event& event : message.events) told.insert(page_of(event, sender));
  told.erase("");
  if (told.empty() || message.events.size() > kMostGuided) told = {sender.page_url + "/"};
  std::string text = "\n";
  for (const std::string& link : told) text += link + "\n";
  return text;
}

// "8 came, 4 went"
std::string counted(const Message& message) {
  std::string text;
  for (std::size_t i = 0; i < message.counts.size(); ++i) {
    if (message.counts.at(i) == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", message.counts.at(i),
                        to_text(static_cast<Change>(i)));
  }
  return text;
}

const monitor::AlarmKind* kind_of(const std::string& alarm) {
  const auto* kind =
      std::find_if(monitor::kAlarmKinds.begin(), monitor::kAlarmKinds.end(),
                   [&](monitor::AlarmKind one) { return alarm == monitor::to_text(one); });
  return kind == monitor::kAlarmKinds.end() ? nullptr : kind;
}

std::string guides(const Message& message) {
  std::set<std::string> told;
  std::string text;
  for (const Event& event : message.events) {
    const monitor::AlarmKind* kind = kind_of(event.alarm);
    if (kind == nullptr || !told.insert(event.alarm).second) continue;
    const monitor::AlarmGuide guide = monitor::guide_of(*kind);
    text += fmt::format("\n{}\n  cause: {}\n  consequence: {}\n  action: {}\n",
                        alarm_words(event.alarm), guide.cause, guide.consequence, guide.action);
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
      {"output_unknown", "Output not known"},
      {"not_normal_mode", "Not in its normal mode"}};
  const auto known = kWords.find(alarm);
  if (known != kWords.end() || alarm.empty()) return known == kWords.end() ? "" : known->second;
  std::string words = alarm;
  std::replace(words.begin(), words.end(), '_', ' ');
  if (words[0] >= 'a' && words[0] <= 'z') words[0] = static_cast<char>(words[0] - 'a' + 'A');
  return words;
}

std::string page_of(const Event& event, const Sender& sender) {
  if (sender.page_url.empty() || event.loop.empty()) return "";
  return sender.page_url + "/#/loop/" + base::percent_encoded(event.loop);
}

std::string sentence(const Event& event, const Sender& sender) {
  if (event.alarm == kDaemonAlarm) return daemon_sentence(event);
  const std::string about =
      event.description.empty() ? "" : fmt::format(" ({})", event.description);
  std::string text = fmt::format("{}{}: {} {}", event.loop, about, alarm_words(event.alarm),
                                 what_happened(event, sender));
  if (event.severity_percent) text += fmt::format(", {:.1f} %", *event.severity_percent);
  if (!event.peer.empty()) text += fmt::format(", by {}", event.peer);
  if (!event.reason.empty()) text += fmt::format(" ({})", event.reason);
  return text;
}

std::string headline(const Message& message, const Sender& sender) {
  if (message.test) return fmt::format("{}: test of channel {}", sender.box, message.channel);
  if (message.count() == 1) {
    return fmt::format("{}: {}", sender.box, sentence(message.events.front(), sender));
  }
  return fmt::format("{}: {} changes of alarms: {}", sender.box, message.count(), counted(message));
}

std::string letter(const Message& message, const Sender& sender) {
  std::string text = headline(message, sender) + "\n\n";
  for (const Event& event : message.events) {
    text +=
        fmt::format("{}  {}\n", local_time(event.utc_ms, *sender.zone), sentence(event, sender));
  }
  const auto listed = static_cast<std::int64_t>(message.events.size());
  if (message.count() > listed) text += fmt::format("... and {} more\n", message.count() - listed);
  if (message.lost > 0) text += fmt::format("{} older ones found no room\n", message.lost);
  if (message.perhaps_twice) text += "This message may have come before.\n";
  if (message.events.size() <= kMostGuided) text += guides(message);
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
          {"noticed_ms", event.noticed_ms}};
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
          .noticed_ms = json.value("noticed_ms", std::int64_t{0})};
}

int priority_of(const Event& event) {
  constexpr int kError = 3;
  constexpr int kWarning = 4;
  constexpr int kNotice = 5;
  if (event.change == Change::unacknowledged) return kError;
  if (event.change != Change::came) return kNotice;
  const monitor::AlarmKind* kind = kind_of(event.alarm);
  const bool now = event.alarm == kDaemonAlarm ||
                   (kind != nullptr && monitor::usual_priority(*kind) >= monitor::Priority::high);
  return now ? kError : kWarning;
}

std::string dump(const json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace loopwarden::notify
