// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/readings.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/console/overview.hpp"
#include "daemon/console/registers.hpp"
#include "daemon/console/request.hpp"
#include "daemon/console/status_json.hpp"
#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon::console {

using nlohmann::json;
namespace model = loopwarden::monitor;

namespace {

constexpr std::size_t kMostTrendRows = 512;
constexpr std::size_t kLongestText = 200;  // bytes

// Whether the device tells where the valve stands.
bool has_read_back(const LoopRuntime& loop) {
  if (const auto* modbus = std::get_if<hal::modbus::LoopModbusSettings>(&loop.config.io)) {
    return modbus->read_back.has_value();
  }
  if (const auto* analog = std::get_if<hal::iio::AnalogSettings>(&loop.config.io)) {
    return analog->read_back.has_value();
  }
  if (std::holds_alternative<hal::replay::ReplaySettings>(loop.config.io)) {
    return loop.channels->position_age_ms.load(std::memory_order_relaxed) >= 0.0F;
  }
  return true;
}

std::vector<std::string> classes() {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < specialist::kConditions; ++i) {
    names.emplace_back(specialist::to_text(static_cast<specialist::Condition>(i)));
  }
  return names;
}

// All loops as text, one after the other: as a tree they take some 30 kB each.
void put_item(std::string& text, const json& item) {
  if (text.back() != '[') text += ',';
  text += text_of(item);
}

json loop_description(const LoopRuntime& loop, const Recorder& recorder) {
  const config::LoopConfig& config = loop.config;
  const bool judged = !config.monitor.specialists.empty();
  json all = ranges_json(loop.settings->get());
  all.update({{"tag", config.name},
              {"description", config.description},
              {"pv_unit", config.pv_unit},
              {"co_unit", config.co_unit},
              {"sample_time_s", config.sample_time_s},
              {"stem", has_read_back(loop)},
              {"monitor", judged || config.monitor.routine},
              {"twin", !config.monitor.twin.empty()},
              {"specialists", judged ? classes() : std::vector<std::string>{}},
              {"recording", config.recording.enabled},
              {"simulated", is_simulated(config)},
              {"folder", recorder.segments_folder(config.name).string()}});
  return all;
}

std::optional<std::int64_t> optional_ms(const json& request, const char* key) {
  const std::optional<std::uint64_t> count = optional_count(request, key);
  return count ? std::optional(static_cast<std::int64_t>(*count)) : std::nullopt;
}

journal::JournalEntry::Kind wanted_kind(const json& request) {
  using Kind = journal::JournalEntry::Kind;
  const std::string name = wanted_text(request, "kind");
  for (const Kind kind : {Kind::alarm, Kind::operator_action, Kind::register_write, Kind::system}) {
    if (name == journal::to_text(kind)) return kind;
  }
  throw RequestError("kind is alarm, operator, register or system");
}

journal::JournalQuery wanted_lines(const json& request) {
  constexpr std::uint64_t kMostLines = 1000;
  journal::JournalQuery query;
  query.most = std::min(optional_count(request, "most", query.most), kMostLines);
  query.before_id = optional_ms(request, "before_id");
  if (request.contains("kind")) query.kind = wanted_kind(request);
  query.text = optional_text(request, "text", kLongestText);
  query.from_ms = optional_ms(request, "from_ms");
  query.to_ms = optional_ms(request, "to_ms");
  return query;
}

}  // namespace

std::size_t loop_index(const Parts& parts, const json& request) {
  const std::string name = wanted_text(request, "loop");
  const std::optional<std::size_t> found = find_loop(parts.loops, name);
  if (!found) throw RequestError("no loop '" + name + "'");
  return *found;
}

model::AlarmKind wanted_alarm(const json& request) {
  const std::string name = wanted_text(request, "alarm");
  for (const model::AlarmKind kind : model::kAlarmKinds) {
    if (name == model::to_text(kind)) return kind;
  }
  std::string all;
  for (const model::AlarmKind kind : model::kAlarmKinds) {
    all += (all.empty() ? "" : ", ") + std::string(model::to_text(kind));
  }
  throw RequestError("no alarm '" + name + "'; alarms are " + all);
}

std::string Readings::answer(std::string_view what, const json& request) {
  if (what == "status") return status();
  if (what == "trend") return done(trend(request));
  if (what == "alarms") return alarms();
  if (what == "describe") return done(describe());
  if (what == "overview") return overview(parts_);
  if (what == "loop") return done(loop(request));
  if (what == "windows") return done(windows(request));
  if (what == "registers") return registers(parts_, optional_flag(request, "values_only"));
  if (what == "explain") return done(explain(request));
  return done(journal(request));
}

std::string Readings::status() const {
  std::string text = R"({"daemon":)" + text_of(parts_.daemon_status()) + R"(,"loops":[)";
  for (std::size_t i = 0; i < parts_.loops.size(); ++i) {
    put_item(text, loop_status(parts_, i));
  }
  text += R"(],"ok":true})";
  return text;
}

json Readings::trend(const json& request) const {
  const std::size_t index = loop_index(parts_, request);
  const std::uint64_t most =
      std::min<std::uint64_t>(optional_count(request, "most", kMostTrendRows), kMostTrendRows);
  const auto rows = parts_.historian.trend(index, optional_count(request, "from", 0), most);
  json period = json::array();
  std::map<std::string, json> columns;
  for (const char* name : {"sp", "pv", "co", "stem", "jacket", "compensator", "mode"})
    columns[name] = json::array();
  for (const auto& row : rows) {
    period.push_back(row.period_index);
    columns["sp"].push_back(number(row.sp));
    columns["pv"].push_back(number(row.pv));
    columns["co"].push_back(number(row.co));
    columns["stem"].push_back(number(row.stem));
    columns["jacket"].push_back(number(static_cast<double>(row.jacket_rate)));
    columns["compensator"].push_back(number(static_cast<double>(row.compensator)));
    columns["mode"].push_back(control::to_text(static_cast<control::Mode>(row.mode)));
  }
  json reply = {{"sample_time_s", parts_.loops[index].config.sample_time_s},
                {"period", std::move(period)}};
  for (auto& [name, values] : columns) reply[name] = std::move(values);
  return reply;
}

std::string Readings::alarms() const {
  std::string text = R"({"alarms":[)";
  for (std::size_t i = 0; i < parts_.board.loops(); ++i) {
    const monitor::LoopWatch watch = parts_.board.watch(i);
    for (const model::AlarmKind kind : model::kAlarmKinds) {
      put_item(text, alarm_json(parts_.board.name(i), kind, watch.alarms.alarm(kind)));
    }
  }
  text += R"(],"now_ms":)" + std::to_string(parts_.board.now_ms()) + R"(,"ok":true})";
  return text;
}

json Readings::describe() const {
  json all = parts_.box_description();
  json loops = json::array();
  for (const LoopRuntime& loop : parts_.loops) {
    loops.push_back(loop_description(loop, parts_.historian.recorder()));
  }
  all["loops"] = std::move(loops);
  return all;
}

json Readings::loop(const json& request) const {
  const std::size_t index = loop_index(parts_, request);
  json all = loop_status(parts_, index);
  all["ranges"] = ranges_json(parts_.loops[index].settings->get());
  const auto newest = parts_.board.watch(index).explanation;
  all["explanation"] = newest ? explanation_json(*newest) : json(nullptr);
  return all;
}

json Readings::windows(const json& request) const {
  json windows = json::array();
  for (const monitor::LoggedWindow& window : parts_.board.windows(loop_index(parts_, request))) {
    windows.push_back(window_json(window));
  }
  return {{"windows", std::move(windows)}};
}

json Readings::explain(const json& request) {
  constexpr std::size_t kMostLines = 200;
  const std::size_t index = loop_index(parts_, request);
  const model::AlarmKind kind = wanted_alarm(request);
  const monitor::LoopWatch watch = parts_.board.watch(index);
  const model::AlarmGuide guide = model::guide_of(kind);
  struct OnDisk {
    std::optional<std::filesystem::path> folder;
    std::vector<journal::JournalRow> rows;
  };
  const std::string name = parts_.board.name(index);
  const std::optional<OnDisk> disk = reader_.ask<OnDisk>(
      [this, name, kind] {
        return OnDisk{parts_.evidence.newest(name, kind), parts_.journal.newest(kMostLines, name)};
      },
      kReaderPatience);
  const auto folder = disk ? disk->folder : std::nullopt;
  json history = json::array();
  for (const journal::JournalRow& row : disk ? disk->rows : std::vector<journal::JournalRow>()) {
    if (row.entry.alarm == model::to_text(kind)) history.push_back(journal_json(row));
  }
  return {{"alarm", alarm_json(parts_.board.name(index), kind, watch.alarms.alarm(kind))},
          {"cause", guide.cause},
          {"consequence", guide.consequence},
          {"action", guide.action},
          {"explanation", explanation_of(watch, kind)},
          {"monitor", watch_json(watch)},
          {"disk_answers", disk.has_value()},
          {"evidence", folder ? json(folder->string()) : json(nullptr)},
          {"history", std::move(history)}};
}

json Readings::journal(const json& request) {
  journal::JournalQuery query = wanted_lines(request);
  if (request.contains("loop")) query.loop = parts_.board.name(loop_index(parts_, request));
  const auto rows = reader_.ask<std::vector<journal::JournalRow>>(
      [this, query] { return parts_.journal.search(query); }, kReaderPatience);
  if (!rows) throw RequestError("the disk does not answer; the journal can't be read");
  json lines = json::array();
  for (const journal::JournalRow& row : *rows) lines.push_back(journal_json(row));
  return {{"lines", std::move(lines)}};
}

}  // namespace loopwarden::daemon::console
