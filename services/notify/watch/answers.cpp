// SPDX-License-Identifier: Apache-2.0
#include "services/notify/watch/answers.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

using nlohmann::json;

json checked(std::string_view answer) {
  json parsed = json::parse(answer);
  if (!parsed.is_object() || !parsed.value("ok", false)) {
    throw std::runtime_error(fmt::format("the daemon says: {}",
                                         one_line(parsed.value("error", std::string("nothing")))));
  }
  return parsed;
}

// Missing or null: empty.
std::string text(const json& object, const char* key) {
  const auto it = object.find(key);
  return it == object.end() || !it->is_string() ? std::string()
                                                : one_line(it->get_ref<const std::string&>());
}

AlarmReading reading_from(const json& alarm) {
  const json& severity = alarm.at("severity_percent");
  return {.key = {text(alarm, "loop"), text(alarm, "alarm")},
          .state = text(alarm, "state"),
          .unacknowledged = alarm.at("unacknowledged").get<bool>(),
          .times_raised = alarm.at("times_raised").get<std::int64_t>(),
          .severity_percent =
              severity.is_number() ? std::optional(severity.get<double>()) : std::nullopt,
          .raised_ms = alarm.value("raised_ms", std::int64_t{0}),
          .changed_ms = alarm.value("changed_ms", std::int64_t{0})};
}

// nlohmann's own errors become the one that the header names.
template <class Read>
auto reading(const char* what, Read read) {
  try {
    return read();
  } catch (const json::exception& e) {
    throw std::runtime_error(fmt::format("no answer with {}: {}", what, one_line(e.what())));
  }
}

}  // namespace

std::vector<AlarmReading> alarms_from(std::string_view answer) {
  return reading("alarms", [&] {
    const json parsed = checked(answer);
    std::vector<AlarmReading> readings;
    for (const json& alarm : parsed.at("alarms")) readings.push_back(reading_from(alarm));
    return readings;
  });
}

std::vector<JournalLine> journal_from(std::string_view answer) {
  return reading("the journal", [&] {
    const json parsed = checked(answer);
    std::vector<JournalLine> lines;
    for (const json& line : parsed.at("lines")) {
      lines.push_back({.id = line.at("id").get<std::int64_t>(),
                       .kind = text(line, "kind"),
                       .key = {text(line, "loop"), text(line, "alarm")},
                       .from = text(line, "from"),
                       .to = text(line, "to"),
                       .peer = text(line, "peer"),
                       .what = text(line, "what"),
                       .reason = text(line, "reason")});
    }
    return lines;
  });
}

std::map<std::string, std::string> descriptions_from(std::string_view answer) {
  return reading("the loops", [&] {
    const json parsed = checked(answer);
    std::map<std::string, std::string> all;
    for (const json& loop : parsed.at("loops")) all[text(loop, "tag")] = text(loop, "description");
    return all;
  });
}

}  // namespace loopwarden::notify
