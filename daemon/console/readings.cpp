// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/readings.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/console/alarm_answers.hpp"
#include "daemon/console/overview.hpp"
#include "daemon/console/registers.hpp"
#include "daemon/console/request.hpp"
#include "daemon/console/setups.hpp"
#include "config/interlocks.hpp"
#include "daemon/console/status.hpp"
#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon::console {

using nlohmann::json;

namespace {

constexpr std::uint64_t kMostTrendRows = 512;
constexpr std::size_t kMostHistory = 200;
constexpr std::uint64_t kUsualHours = 24;
constexpr std::uint64_t kMostHours = 720;
constexpr std::size_t kMostCame = 50'000;

// Returns true if the device measures the position of the valve.
bool has_read_back(const LoopRuntime& loop) {
  if (const auto* modbus = std::get_if<hal::modbus::LoopModbusSettings>(&loop.config.io)) {
    return modbus->read_back.has_value();
  }
  if (const auto* source = std::get_if<hal::modbus::ModbusSourceSettings>(&loop.config.io)) {
    return source->stem.has_value();
  }
  if (const auto* feed = std::get_if<hal::feed::FeedSettings>(&loop.config.io)) {
    return feed->stem.has_value();
  }
  if (const auto* analog = std::get_if<hal::iio::AnalogSettings>(&loop.config.io)) {
    return analog->read_back.has_value();
  }
  if (config::out_of_service(loop.config.io) != nullptr) return false;
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

// Appends one loop as text: as a JSON tree, each loop would need about 30 kB.
void put_item(std::string& text, const json& item) {
  if (text.back() != '[') text += ',';
  text += text_of(item);
}

protocol::LoopDescription description_of(const LoopRuntime& loop, const Recorder& recorder) {
  const config::LoopConfig& config = loop.config;
  const bool judged = !config.monitor.specialists.empty();
  const rt::LoopSettings settings = loop.settings->get();
  const protocol::Ranges ranges = ranges_of(settings);
  protocol::Maybe<std::string> action;
  if (!loop.watched()) {
    action = settings.controller.pid.action == control::Action::direct ? "direct" : "reverse";
  }
  return {.tag = config.name,
          .description = config.description,
          .area = config.area,
          .master = config.master,
          .control = control_of(loop),
          .pv_unit = config.pv_unit,
          .co_unit = config.co_unit,
          .sample_time_s = config.sample_time_s,
          .stem = has_read_back(loop),
          .monitor = judged || config.monitor.routine,
          .twin = !config.monitor.twin.empty(),
          .specialists = judged ? classes() : std::vector<std::string>{},
          .recording = config.recording.enabled,
          .simulated = is_simulated(config),
          .folder = recorder.segments_folder(config.name).string(),
          .pv_range = ranges.pv_range,
          .co_range = ranges.co_range,
          .sp_limits = ranges.sp_limits,
          .output_limits = ranges.output_limits,
          .source = config::connection_of(config.io),
          .action = std::move(action)};
}

std::optional<std::int64_t> moment(std::int64_t utc_ms) {
  return utc_ms == 0 ? std::nullopt : std::optional(utc_ms);
}

protocol::Report report_of(const reports::Report& r) {
  using reports::State;
  protocol::Report told{.name = r.name,
                        .loop = r.order.loop,
                        .kind = reports::to_text(r.order.kind),
                        .from_ms = r.order.from_ms,
                        .to_ms = r.order.to_ms,
                        .by = r.order.by,
                        .asked_ms = r.asked_ms,
                        .state = reports::to_text(r.state),
                        .place = {},
                        .due_ms = {},
                        .started_ms = moment(r.started_ms),
                        .ended_ms = moment(r.ended_ms),
                        .doing = r.doing,
                        .percent = {},
                        .sentence = r.sentence,
                        .page = {}};
  if (r.state == State::waiting && r.order.due_ms > 0) told.due_ms = r.order.due_ms;
  if (r.place > 0) told.place = r.place;
  if (!r.doing.empty()) told.percent = static_cast<std::uint64_t>(r.percent);
  if (r.has_page) told.page = "reports/" + r.name + "/" + reports::page_of(r.order.kind);
  return told;
}

std::optional<std::int64_t> signed_count(const protocol::Maybe<std::uint64_t>& count) {
  return count ? std::optional(static_cast<std::int64_t>(*count)) : std::nullopt;
}

journal::JournalEntry::Kind wanted_kind(const std::string& name) {
  using Kind = journal::JournalEntry::Kind;
  for (const Kind kind :
       {Kind::alarm, Kind::operator_action, Kind::register_write, Kind::test, Kind::system}) {
    if (name == journal::to_text(kind)) return kind;
  }
  throw RequestError("kind is alarm, operator, register, test or system");
}

journal::JournalQuery wanted_lines(const protocol::JournalRequest& request) {
  constexpr std::uint64_t kMostLines = 1000;
  journal::JournalQuery query;
  query.most = std::min<std::uint64_t>(request.most.value_or(query.most), kMostLines);
  query.before_id = signed_count(request.before_id);
  if (request.kind) query.kind = wanted_kind(*request.kind);
  query.text = short_text(request.text, "text");
  query.from_ms = signed_count(request.from_ms);
  query.to_ms = signed_count(request.to_ms);
  return query;
}

}  // namespace

struct Readings::Request {
  std::string_view name;
  std::string (*answer)(Readings& from, const json& request);
};

const Readings::Request* Readings::find(std::string_view name) noexcept {
  using From = Readings;
  static constexpr std::array kRequests{
      Request{"status", [](From& from, const json&) { return from.status(); }},
      Request{"trend", [](From& from, const json& r) { return done(from.trend(r)); }},
      Request{"alarms", [](From& from, const json&) { return from.alarms(); }},
      Request{"alarm_design", [](From& from, const json& r) { return done(from.alarm_design(r)); }},
      Request{"alarm_figures",
              [](From& from, const json& r) { return done(from.alarm_figures(r)); }},
      Request{"explain", [](From& from, const json& r) { return done(from.explain(r)); }},
      Request{"journal", [](From& from, const json& r) { return done(from.journal(r)); }},
      Request{"describe", [](From& from, const json&) { return done(from.describe()); }},
      Request{"links", [](From& from, const json&) { return done(from.info_.links()); }},
      Request{"setups",
              [](From& from, const json&) { return done(setups_in(from.info_.configuration())); }},
      Request{"overview",
              [](From& from, const json&) {
                return to_text(overview(from.plant_, from.info_.config_hash()));
              }},
      Request{"loop", [](From& from, const json& r) { return done(from.loop(r)); }},
      Request{"windows", [](From& from, const json& r) { return done(from.windows(r)); }},
      Request{"twin", [](From& from, const json& r) { return done(from.twin(r)); }},
      Request{
          "registers",
          [](From& from, const json& r) { return to_text(registers(from.plant_, from.info_, r)); }},
      Request{"reports", [](From& from, const json& r) { return done(from.reports(r)); }},
  };
  const auto* const found = std::find_if(kRequests.begin(), kRequests.end(),
                                         [&](const Request& one) { return one.name == name; });
  return found == kRequests.end() ? nullptr : found;
}

bool Readings::offers(std::string_view name) noexcept { return find(name) != nullptr; }

std::string Readings::answer(std::string_view name, const json& request) {
  const Request* const found = find(name);
  if (found == nullptr) throw RequestError("unknown request '" + std::string(name) + "'");
  return found->answer(*this, request);
}

// Returns protocol::Status as text.
std::string Readings::status() const {
  std::string text = R"({"daemon":)" + text_of(info_.status()) + R"(,"loops":[)";
  for (std::size_t i = 0; i < plant_.loops.size(); ++i) {
    put_item(text, loop_status(plant_, i));
  }
  text += R"(],"ok":true})";
  return text;
}

protocol::Trend Readings::trend(const protocol::TrendRequest& request) const {
  const std::size_t index = loop_index(plant_, request.loop);
  const std::uint64_t most = std::min(request.most.value_or(kMostTrendRows), kMostTrendRows);
  protocol::Trend trend;
  trend.sample_time_s = plant_.loops[index].config.sample_time_s;
  for (const auto& row : plant_.historian.trend(index, request.from.value_or(0), most)) {
    trend.period.push_back(row.period_index);
    trend.sp.push_back(row.sp);
    trend.pv.push_back(row.pv);
    trend.co.push_back(row.co);
    trend.stem.push_back(row.stem);
    trend.jacket.push_back(static_cast<double>(row.jacket_rate));
    trend.compensator.push_back(static_cast<double>(row.compensator));
    trend.mode.emplace_back(control::to_text(row.mode));
  }
  return trend;
}

// Returns protocol::Alarms as text.
std::string Readings::alarms() const {
  std::string text = R"({"alarms":[)";
  for (std::size_t i = 0; i < plant_.alarms.loops(); ++i) {
    const supervision::AlarmSnapshot watch = plant_.alarms.snapshot(i);
    for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
      if (!watch.alarms.fitted(kind)) continue;
      put_item(text, alarm_of(plant_.alarms.name(i), kind, watch));
    }
  }
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) {
    put_item(text, alarm_of(kind, plant_.box_alarms));
  }
  text += R"(],"incidents":[)";
  for (std::size_t i = 0; i < plant_.alarms.loops(); ++i) {
    std::optional<protocol::Incident> incident;
    plant_.alarms.look(i, [&](const supervision::AlarmSnapshot& watch) {
      incident = incident_of(plant_.alarms.name(i), watch);
    });
    if (incident) put_item(text, *incident);
  }
  text += R"(],"now_ms":)" + std::to_string(plant_.alarms.now_ms()) + R"(,"ok":true})";
  return text;
}

protocol::AlarmDesigns Readings::alarm_design(const protocol::AlarmDesignRequest& request) const {
  return request.loop ? alarm_designs(plant_, loop_index(plant_, *request.loop))
                      : alarm_designs(plant_);
}

protocol::AlarmFigures Readings::alarm_figures(const protocol::AlarmFiguresRequest& request) {
  const std::uint64_t hours = request.hours.value_or(kUsualHours);
  if (hours < 1 || hours > kMostHours) {
    throw RequestError("hours must be a whole number from 1 to 720");
  }
  const std::int64_t now_ms = plant_.alarms.now_ms();
  const std::int64_t asked_ms = now_ms - static_cast<std::int64_t>(hours) * 3'600'000;
  const auto came = reader_.ask<std::vector<alarm::AlarmCame>>(
      [this, asked_ms, now_ms] { return archive_.journal.came(asked_ms, now_ms, kMostCame); },
      kReaderPatience);
  if (!came) throw RequestError("the disk does not answer; the journal can't be read");
  // If the limit is reached, the figures cover the time of the lines that were read.
  const std::int64_t from_ms = came->size() < kMostCame ? asked_ms : came->back().utc_ms + 1;
  return figures_of(plant_, *came, from_ms, now_ms);
}

protocol::Description Readings::describe() const {
  protocol::Description all = info_.description();
  for (const LoopRuntime& loop : plant_.loops) {
    all.loops.push_back(description_of(loop, plant_.historian.recorder()));
  }
  return all;
}

protocol::LoopAnswer Readings::loop(const protocol::LoopRequest& request) const {
  const std::size_t index = loop_index(plant_, request.loop);
  const auto newest = plant_.alarms.snapshot(index).explanation;
  return {.status = loop_status(plant_, index),
          .ranges = ranges_of(plant_.loops[index].settings->get()),
          .explanation = newest ? std::optional(told(*newest)) : std::nullopt};
}

protocol::TwinModel Readings::twin(const protocol::TwinRequest& request) const {
  const std::string text = info_.twin(loop_index(plant_, request.loop));
  return {text.empty() ? std::nullopt : std::optional(text)};
}

protocol::Windows Readings::windows(const protocol::WindowsRequest& request) const {
  protocol::Windows all;
  for (const supervision::LoggedWindow& one :
       plant_.alarms.of(loop_index(plant_, request.loop)).windows()) {
    all.windows.push_back(window_of(one));
  }
  return all;
}

protocol::Reports Readings::reports(const protocol::ReportsRequest& request) const {
  const std::string& loop = plant_.alarms.name(loop_index(plant_, request.loop));
  const auto known = archive_.reports.of(loop);
  if (!known) throw RequestError("the reports of before the start are being read");
  protocol::Reports all;
  for (const reports::Report& report : *known) all.reports.push_back(report_of(report));
  return all;
}

protocol::Explained Readings::explain_box(const protocol::ExplainRequest& request) {
  const alarm::BoxAlarm kind = wanted_box_alarm(request.alarm);
  const alarm::AlarmGuide guide = alarm::guide_of(kind);
  protocol::Explained answer{.alarm = alarm_of(kind, plant_.box_alarms),
                             .cause = guide.cause,
                             .consequence = guide.consequence,
                             .action = guide.action,
                             .time_to_act = guide.time_to_act};
  const auto rows = reader_.ask<std::vector<journal::JournalRow>>(
      [this] { return archive_.journal.newest(kMostHistory, alarm::kBox); }, kReaderPatience);
  answer.disk_answers = rows.has_value();
  for (const journal::JournalRow& row : rows.value_or(std::vector<journal::JournalRow>{})) {
    if (row.entry.alarm == request.alarm) answer.history.push_back(line_of(row));
  }
  return answer;
}

protocol::Explained Readings::explain(const protocol::ExplainRequest& request) {
  if (request.loop == alarm::kBox) return explain_box(request);
  const std::size_t index = loop_index(plant_, request.loop);
  const alarm::AlarmKind kind = wanted_alarm(request.alarm);
  const supervision::AlarmSnapshot watch = plant_.alarms.snapshot(index);
  const config::AlarmTexts guide = plant_.loops[index].config.alarms.guide(kind);
  struct OnDisk {
    std::optional<std::filesystem::path> folder;
    std::vector<journal::JournalRow> rows;
  };
  const std::string name = plant_.alarms.name(index);
  const std::optional<OnDisk> disk = reader_.ask<OnDisk>(
      [this, name, kind] {
        return OnDisk{archive_.evidence.newest(name, kind),
                      archive_.journal.newest(kMostHistory, name)};
      },
      kReaderPatience);
  protocol::Explained answer{.alarm = alarm_of(name, kind, watch),
                             .cause = guide.cause,
                             .consequence = guide.consequence,
                             .action = guide.action,
                             .time_to_act = guide.time_to_act,
                             .explanation = explanation_of(watch, kind),
                             .monitor = monitor_of(watch, plant_.loops[index].config),
                             .disk_answers = disk.has_value()};
  if (!disk) return answer;
  if (disk->folder) answer.evidence = disk->folder->string();
  for (const journal::JournalRow& row : disk->rows) {
    if (row.entry.alarm == alarm::to_text(kind)) answer.history.push_back(line_of(row));
  }
  return answer;
}

protocol::Journal Readings::journal(const protocol::JournalRequest& request) {
  journal::JournalQuery query = wanted_lines(request);
  if (request.loop) {
    query.loop = *request.loop == alarm::kBox
                     ? *request.loop
                     : plant_.alarms.name(loop_index(plant_, *request.loop));
  }
  const auto rows = reader_.ask<std::vector<journal::JournalRow>>(
      [this, query] { return archive_.journal.search(query); }, kReaderPatience);
  if (!rows) throw RequestError("the disk does not answer; the journal can't be read");
  protocol::Journal all;
  for (const journal::JournalRow& row : *rows) all.lines.push_back(line_of(row));
  return all;
}

}  // namespace loopwarden::daemon::console
