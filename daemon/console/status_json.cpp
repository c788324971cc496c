// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/status_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "daemon/console/request.hpp"
#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon::console {

using nlohmann::json;
namespace model = loopwarden::monitor;

namespace {

json io_status(const hal::IoCounters& c) {
  return {{"connected", c.connected},
          {"transactions", c.transactions},
          {"timeouts", c.timeouts},
          {"device_exceptions", c.device_exceptions},
          {"invalid_replies", c.invalid_replies},
          {"stale_replies_discarded", c.stale_replies_discarded},
          {"reconnects", c.reconnects},
          {"writes", c.writes},
          {"write_errors", c.write_errors},
          {"old_commands_withheld", c.old_commands_withheld}};
}

const char* source_text(model::StickSource source) {
  switch (source) {
    case model::StickSource::read_back: return "read-back";
    case model::StickSource::ellipse: return "PV and CO";
    case model::StickSource::none: break;
  }
  return "none";
}

json condition_json(const analysis::ConditionIndices& condition) {
  return {{"control_performance", number(condition.control_performance)},
          {"valve", number(condition.valve)},
          {"actuator", number(condition.actuator)},
          {"positioner", number(condition.positioner)},
          {"environment", number(condition.environment)}};
}

json recording_json(const RecordingStatus& recording) {
  return {{"rows", recording.rows},
          {"dropped", recording.dropped},
          {"waiting", recording.waiting},
          {"queue_dropped", recording.queue_dropped},
          {"bytes", recording.segments.bytes},
          {"rows_lost", recording.segments.rows_lost},
          {"disk_errors", recording.segments.disk_errors},
          {"last_disk_error", recording.segments.last_error},
          {"csv_file", recording.csv_file},
          {"csv_error", recording.csv_error}};
}

// What the newest cycle says.
json row_json(const record::RecordRow& row, const rt::LoopSettings& settings) {
  const auto flag = [&](record::RecordFlag bit) { return (row.flags & bit) != 0; };
  return {{"period", row.period_index},
          {"sp", number(row.sp)},
          {"pv", number(row.pv)},
          {"co", number(row.co)},
          {"stem", number(row.stem)},
          {"mode", control::to_text(static_cast<control::Mode>(row.mode))},
          {"requested_mode", control::to_text(static_cast<control::Mode>(row.requested_mode))},
          {"fault", control::to_text(static_cast<control::Fault>(row.fault))},
          {"pv_quality", hal::to_text(static_cast<hal::Quality>(row.pv_quality))},
          {"pv_reason", hal::to_text(static_cast<hal::Reason>(row.pv_reason))},
          {"pv_limit", hal::to_text(static_cast<hal::Limit>(row.pv_limit))},
          {"pv_age_ms", number(static_cast<double>(row.age_ms))},
          {"at_low", flag(record::kAtLow)},
          {"at_high", flag(record::kAtHigh)},
          {"rate_limited", flag(record::kRateLimited)},
          {"output_lost", flag(record::kOutputLost)},
          {"jacket",
           {{"form", form_text(row.jacket_form)},
            {"acting", flag(record::kJacketActs)},
            {"rate", number(static_cast<double>(row.jacket_rate))},
            {"shadow_rate", number(static_cast<double>(row.jacket_rate_shadow))}}},
          {"compensator",
           {{"kind", control::to_text(settings.controller.compensator.kind)},
            {"acting", flag(record::kCompensatorActs)},
            {"added", number(static_cast<double>(row.compensator))},
            {"shadow_added", number(static_cast<double>(row.compensator_shadow))}}}};
}

// Of a specialist: how sure it is that this is its window.
double probability_of(const monitor::LoggedWindow& window, specialist::Condition condition) {
  const auto p = [&](model::AlarmKind kind) {
    return static_cast<double>(window.probability[model::index_of(kind)]);
  };
  switch (condition) {
    case specialist::Condition::stiction: return p(model::AlarmKind::stiction);
    case specialist::Condition::backlash: return p(model::AlarmKind::backlash);
    case specialist::Condition::hysteresis: return p(model::AlarmKind::hysteresis);
    case specialist::Condition::low_air_supply: return p(model::AlarmKind::low_air_supply);
    case specialist::Condition::other: return p(model::AlarmKind::unknown);
    case specialist::Condition::no_fault: break;
  }
  double faults = 0.0;
  for (const float one : window.probability) faults += static_cast<double>(one);
  return std::max(0.0, 1.0 - faults);
}

const char* verdict_text(const monitor::LoggedWindow& window) {
  using Result = model::WindowJudgement::Result;
  return window.result == Result::fault ? model::to_text(window.fault)
                                        : model::to_text(window.result);
}

// Six digits: a float has no more.
double rounded(double value) {
  return std::isfinite(value) ? std::stod(fmt::format("{:.6g}", value)) : value;
}

}  // namespace

const char* form_text(std::uint8_t jacket_form) {
  switch (static_cast<control::JacketForm>(jacket_form)) {
    case control::JacketForm::off: return "off";
    case control::JacketForm::paper: return "paper";
    case control::JacketForm::bounded: return "bounded";
    case control::JacketForm::dwell: break;
  }
  return "dwell";
}

json alarm_json(const std::string& loop, model::AlarmKind kind, const model::Alarm& alarm) {
  const model::AlarmMemory& memory = alarm.memory();
  const auto size = [kind](double percent) {
    return model::has_size(kind) ? number(percent) : json(nullptr);
  };
  return {{"loop", loop},
          {"alarm", model::to_text(kind)},
          {"state", model::to_text(alarm.state())},
          {"active", alarm.active()},
          {"unacknowledged", alarm.unacknowledged()},
          {"consequence", alarm.is_consequence() && alarm.active()},
          {"raised_ms", memory.raised_ms},
          {"changed_ms", memory.changed_ms},
          {"times_raised", memory.times_raised},
          {"shelved_until_ms", memory.shelved_until_ms},
          {"severity_percent", size(memory.severity_percent)},
          {"worst_severity_percent", size(memory.worst_severity_percent)}};
}

json explanation_json(const Explanation& e) {
  return {{"alarm", model::to_text(e.alarm)},
          {"final_name", e.final_name ? json(model::to_text(*e.final_name)) : json(nullptr)},
          {"raised_ms", e.raised_ms},
          {"ended_ms", e.ended_ms},
          {"verdict", e.verdict},
          {"effect", e.effect},
          {"size_percent", number(e.size_percent)},
          {"low_percent", number(e.low_percent)},
          {"high_percent", number(e.high_percent)},
          {"confidence", number(e.confidence)},
          {"alternatives", e.alternatives},
          {"gap_closed", number(e.gap_closed)},
          {"agrees", e.agrees},
          {"since_s", number(e.since_s)},
          {"sentence", e.sentence},
          {"remedy", e.remedy},
          {"folder", e.folder.string()}};
}

json explanation_of(const monitor::LoopWatch& watch, model::AlarmKind kind) {
  if (const auto& own = watch.explanations[model::index_of(kind)]) return explanation_json(*own);
  const auto& newest = watch.explanation;
  return newest && newest->final_name == kind ? explanation_json(*newest) : json(nullptr);
}

json watch_json(const monitor::LoopWatch& watch) {
  const model::WindowMeasures& m = watch.measures;
  const bool no_size = watch.judgement.result == model::WindowJudgement::Result::fault &&
                       !model::has_size(watch.judgement.fault);
  json probability = json::object();
  for (const model::AlarmKind kind : model::kWindowAlarms) {
    probability[model::to_text(kind)] = watch.judgement.probability[model::index_of(kind)];
  }
  return {{"window_state", model::to_text(watch.window_state)},
          {"windows", watch.windows},
          {"windows_suppressed", watch.windows_suppressed},
          {"probability", std::move(probability)},
          {"severity_percent", no_size ? json(nullptr) : number(watch.judgement.severity_percent)},
          {"oscillation_index", number(m.oscillation_index)},
          {"oscillation_period_s", number(m.period_s)},
          {"variability_percent", number(m.variability_percent)},
          {"mean_error_percent", number(m.mean_error_percent)},
          {"saturated_percent", number(m.saturated_percent)},
          {"bridged_cycles", m.bridged_cycles},
          {"travel_percent_per_hour", number(m.travel_percent_per_hour)},
          {"reversals_per_hour", number(m.reversals_per_hour)},
          {"stick_percent",
           m.stick_source == model::StickSource::none ? json(nullptr) : number(m.stick_percent)},
          {"stick_source", source_text(m.stick_source)},
          {"condition", condition_json(watch.condition)},
          {"corrective_action", model::to_text(watch.corrective)},
          {"hours_automatic", watch.times.seconds_in(control::Mode::automatic) / 3600.0},
          {"hours_manual", watch.times.seconds_in(control::Mode::manual) / 3600.0},
          {"hours_at_limit", watch.times.seconds_at_limit() / 3600.0}};
}

json window_json(const monitor::LoggedWindow& window) {
  const bool before_judge = window.state == model::WindowState::valid ||
                            window.state == model::WindowState::not_enough_movement;
  json all = {{"time_ms", window.utc_ms},
              {"verdict", before_judge ? json(verdict_text(window)) : json(nullptr)},
              {"suppressed", window.state == model::WindowState::valid
                                 ? json(nullptr)
                                 : json(model::to_text(window.state))},
              {"severity_percent", nullptr},
              {"specialists", json::array()}};
  if (!before_judge) return all;
  if (window.result == model::WindowJudgement::Result::fault && model::has_size(window.fault)) {
    all["severity_percent"] = rounded(static_cast<double>(window.severity_percent));
  }
  for (std::size_t i = 0; i < specialist::kConditions; ++i) {
    const auto condition = static_cast<specialist::Condition>(i);
    all["specialists"].push_back({{"class", specialist::to_text(condition)},
                                  {"mse", number(rounded(static_cast<double>(window.errors[i])))},
                                  {"probability", rounded(probability_of(window, condition))}});
  }
  return all;
}

json journal_json(const journal::JournalRow& row) {
  const journal::JournalEntry& e = row.entry;
  return {{"id", row.id},
          {"utc_ms", e.utc_ms},
          {"kind", journal::to_text(e.kind)},
          {"loop", e.loop},
          {"alarm", e.alarm},
          {"from", e.from},
          {"to", e.to},
          {"severity_percent", e.severity_percent ? json(*e.severity_percent) : json(nullptr)},
          {"peer", e.peer},
          {"what", e.what},
          {"old", e.old_value},
          {"new", e.new_value},
          {"result", e.result},
          {"reason", e.reason}};
}

json ranges_json(const rt::LoopSettings& settings) {
  const control::ControllerSettings& controller = settings.controller;
  return {{"pv_range", {settings.pv_check.low, settings.pv_check.high}},
          {"co_range", {controller.pid.output_low, controller.pid.output_high}},
          {"sp_limits", {controller.set_point.low, controller.set_point.high}},
          {"output_limits", {controller.output.low, controller.output.high}}};
}

json loop_status(const Parts& parts, std::size_t index) {
  const LoopRuntime& runtime = parts.loops[index];
  const config::LoopConfig& config = runtime.config;
  const rt::LoopSettings settings = runtime.settings->get();
  const monitor::LoopWatch watch = parts.board.watch(index);
  const auto position_age_ms =
      static_cast<double>(runtime.channels->position_age_ms.load(std::memory_order_relaxed));
  json alarm_states = json::object();
  for (const model::AlarmKind kind : model::kAlarmKinds) {
    alarm_states[model::to_text(kind)] = alarm_json(config.name, kind, watch.alarms.alarm(kind));
  }
  json loop = {
      {"name", config.name},
      {"description", config.description},
      {"pv_unit", config.pv_unit},
      {"co_unit", config.co_unit},
      {"pv_range", {settings.pv_check.low, settings.pv_check.high}},
      {"co_range", {settings.controller.pid.output_low, settings.controller.pid.output_high}},
      {"sample_time_s", config.sample_time_s},
      {"io", io_status(runtime.io->counters())},
      {"recording", recording_json(parts.historian.status(index))},
      {"monitor", watch_json(watch)},
      {"alarms", std::move(alarm_states)},
      {"orders_refused", runtime.channels->orders_refused.load(std::memory_order_relaxed)},
      {"position_age_ms", position_age_ms < 0.0 ? json(nullptr) : number(position_age_ms)}};
  record::RecordRow row;
  if (!parts.historian.latest(index, row)) return loop;
  loop["ne107"] = model::to_text(health_of(config, row, watch, parts.severe_percent));
  loop["time_s"] = static_cast<double>(row.period_index) * config.sample_time_s;
  loop.update(row_json(row, settings));
  // Where a ramp goes: what an order's `expect` is held against.
  loop["set_point_wanted"] =
      number(runtime.channels->set_point_wanted.load(std::memory_order_relaxed));
  return loop;
}

}  // namespace loopwarden::daemon::console
