// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/alarm_state_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>

#include "base/file.hpp"
#include "record/segment_format.hpp"

namespace loopwarden::daemon::journal {
namespace {

using monitor::AlarmMemory;
using nlohmann::json;

constexpr std::size_t kChecksumLine = 9;  // eight digits and a line end

std::string checksum_line(std::string_view text) {
  return fmt::format("{:08x}\n", record::crc32(std::span(text.data(), text.size())));
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
  return {.raised = static_cast<monitor::AlarmState>(j.at("state").get<std::uint8_t>()),
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
  const std::string body = json{{"revision", states.revision}, {"alarms", std::move(alarms)}}.dump(
                               -1, ' ', false, json::error_handler_t::replace) +
                           "\n";
  const std::string text = checksum_line(body) + body;
  const std::filesystem::path temporary = path_.string() + ".tmp";
  base::File file(temporary, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file.is_open() || !file.write(text.data(), text.size()) || !file.sync() || !file.close()) {
    why = fmt::format("{}: {}", temporary.string(), base::error_text(errno));
    return false;
  }
  std::error_code error;
  std::filesystem::rename(temporary, path_, error);
  if (error) {
    why = fmt::format("{}: {}", path_.string(), error.message());
    return false;
  }
  return base::sync_folder(path_.parent_path());
}

std::optional<AlarmStates> AlarmStateFile::load(std::string& why) const {
  std::ifstream stream(path_, std::ios::binary);
  if (!stream) return std::nullopt;
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  try {
    if (text.size() < kChecksumLine) throw std::runtime_error("it is cut short");
    const std::string body = text.substr(kChecksumLine);
    if (text.compare(0, kChecksumLine, checksum_line(body)) != 0) {
      throw std::runtime_error("its checksum is wrong");
    }
    const json j = json::parse(body);
    AlarmStates states;
    states.revision = j.at("revision").get<std::uint64_t>();
    for (const json& alarm : j.at("alarms")) {
      states.memories[{alarm.at("loop").get<std::string>(), alarm.at("alarm").get<std::string>()}] =
          memory_of(alarm);
    }
    return states;
  } catch (const std::exception& e) {
    why = fmt::format("{} is damaged: {}", path_.string(), e.what());
    return std::nullopt;
  }
}

}  // namespace loopwarden::daemon::journal
