// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/alarm_state_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "daemon/journal/incident_text.hpp"

namespace loopwarden::daemon::journal {
namespace {

using alarm::AlarmMemory;
using nlohmann::json;

constexpr std::size_t kChecksumLine = 9;  // eight digits and a line end

std::string checksum_line(std::string_view text) {
  return fmt::format("{:08x}\n", base::crc32(text));
}

json to_json(const AlarmKey& key, const AlarmMemory& memory) {
  return {{"loop", key.first},
          {"alarm", key.second},
          {"state", static_cast<int>(memory.raised)},
          {"shelved_until_ms", memory.shelved_until_ms},
          {"raised_ms", memory.raised_ms},
          {"changed_ms", memory.changed_ms},
          {"times_raised", memory.times_raised},
          {"severity_percent", memory.severity_percent},
          {"worst_severity_percent", memory.worst_severity_percent}};
}

AlarmMemory memory_of(const json& j) {
  return {.raised = static_cast<alarm::AlarmState>(j.at("state").get<std::uint8_t>()),
          .shelved_until_ms = j.at("shelved_until_ms").get<std::int64_t>(),
          .raised_ms = j.at("raised_ms").get<std::int64_t>(),
          .changed_ms = j.at("changed_ms").get<std::int64_t>(),
          .times_raised = j.at("times_raised").get<std::uint32_t>(),
          .severity_percent = j.at("severity_percent").get<double>(),
          .worst_severity_percent = j.at("worst_severity_percent").get<double>()};
}

}  // namespace

bool AlarmStateFile::save(const AlarmStates& states, std::string& why) const {
  json alarms = json::array();
  for (const auto& [key, memory] : states.memories) alarms.push_back(to_json(key, memory));
  json incidents = json::object();
  for (const auto& [loop, state] : states.incidents) incidents[loop] = write_incident(state);
  const std::string body = json{{"revision", states.revision},
                                {"alarms", std::move(alarms)},
                                {"incidents", std::move(incidents)}}
                               .dump(-1, ' ', false, json::error_handler_t::replace) +
                           "\n";
  const std::string text = checksum_line(body) + body;
  const std::optional<base::FileError> error = base::replace_file(path_, text);
  if (error) why = error->text();
  return !error;
}

std::optional<AlarmStates> AlarmStateFile::load(std::string& why) const {
  const std::optional<std::string> text = base::read_file(path_);
  if (!text) return std::nullopt;
  try {
    if (text->size() < kChecksumLine) throw std::runtime_error("it is truncated");
    const std::string body = text->substr(kChecksumLine);
    if (text->compare(0, kChecksumLine, checksum_line(body)) != 0) {
      throw std::runtime_error("its checksum is wrong");
    }
    const json j = json::parse(body);
    AlarmStates states;
    states.revision = j.at("revision").get<std::uint64_t>();
    for (const json& alarm : j.at("alarms")) {
      states.memories[{alarm.at("loop").get<std::string>(), alarm.at("alarm").get<std::string>()}] =
          memory_of(alarm);
    }
    // Files from before incidents existed have no such key.
    const json incidents = j.value("incidents", json::object());
    for (const auto& [loop, state] : incidents.items()) {
      if (auto known = read_incident(state.get<std::string>())) {
        states.incidents[loop] = std::move(*known);
      }
    }
    return states;
  } catch (const std::exception& e) {
    why = fmt::format("{} is damaged: {}", path_.string(), e.what());
    return std::nullopt;
  }
}

}  // namespace loopwarden::daemon::journal
