// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reload_keys.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "config/loop_model_writer.hpp"

namespace loopwarden::daemon::reload {
namespace {

using config::DaemonConfig;
using config::LoopConfig;

constexpr const char* kRestart = "needs a restart";
constexpr const char* kNextStart = "applies at the next start";

struct Range {
  double low = 0.0;
  double high = 0.0;
  friend bool operator==(const Range&, const Range&) = default;
};

struct FrozenAfter {
  double seconds = 0.0;
  bool acts = false;
  friend bool operator==(const FrozenAfter&, const FrozenAfter&) = default;
};

const char* name_of(control::Action action) {
  return action == control::Action::direct ? "direct" : "reverse";
}
const char* name_of(control::AntiWindup kind) { return config::to_text(kind); }
const char* name_of(control::JacketForm form) { return config::to_text(form); }
const char* name_of(control::Recovery recovery) {
  return recovery == control::Recovery::manual ? "manual" : "previous_mode";
}

const char* name_of(alarm::NormalMode mode) { return alarm::to_text(mode); }

// normal_mode has a separate row.
config::LoopAlarmConfig alarms_without_mode(const LoopConfig& loop) {
  config::LoopAlarmConfig alarms = loop.alarms;
  alarms.process.normal_mode = {};
  return alarms;
}

// Returns the value for a reader; empty if that takes more than a few words.
template <class T>
std::string shown(const T& value) {
  if constexpr (std::is_same_v<T, double>) {
    return std::isinf(value) ? "none" : fmt::format("{}", value);
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_arithmetic_v<T>) {
    return fmt::format("{}", value);
  } else if constexpr (std::is_same_v<T, std::string>) {
    return value.empty() ? "none" : value;
  } else if constexpr (std::is_same_v<T, Range>) {
    return fmt::format("[{}, {}]", value.low, value.high);
  } else if constexpr (std::is_same_v<T, FrozenAfter>) {
    return fmt::format("{}{}", value.seconds, value.acts ? "" : " (alarm only)");
  } else if constexpr (std::is_same_v<T, control::OutputAction>) {
    return value.kind == control::OutputAction::Kind::hold ? "hold" : shown(value.value);
  } else if constexpr (std::is_same_v<T, config::SocketRights>) {
    return fmt::format("{{alarms: {}, control: {}{}{}{}}}", value.alarms, value.control,
                       value.tuning ? ", tuning: true" : "", value.reports ? ", reports: true" : "",
                       value.tests ? ", tests: true" : "");
  } else if constexpr (std::is_same_v<T, control::CompensatorSettings>) {
    return control::to_text(value.kind);
  } else if constexpr (std::is_enum_v<T>) {
    return name_of(value);
  } else {
    return {};
  }
}

template <class Config>
struct Row {
  const char* key;
  Effect effect;
  const char* why;
  bool (*differs)(const Config&, const Config&);
  std::string (*text)(const Config&);
};

template <class Config, class Get>
constexpr Row<Config> row(const char* key, Effect effect, Get, const char* why = nullptr) {
  const char* usual = effect == Effect::applied ? "" : kRestart;
  if (effect == Effect::meaning) usual = kMeaning;
  return {key, effect, why != nullptr ? why : usual,
          [](const Config& a, const Config& b) { return !(Get{}(a) == Get{}(b)); },
          [](const Config& c) { return shown(Get{}(c)); }};
}

constexpr Effect kApplied = Effect::applied;
constexpr Effect kWaits = Effect::restart;
constexpr Effect kKept = Effect::meaning;

template <class Get>
constexpr Row<LoopConfig> loop_row(const char* key, Effect effect, Get get,
                                   const char* why = nullptr) {
  return row<LoopConfig>(key, effect, get, why);
}
template <class Get>
constexpr Row<DaemonConfig> daemon_row(const char* key, Effect effect, Get get) {
  return row<DaemonConfig>(key, effect, get);
}

// clang-format off
constexpr auto kLoopRows = std::to_array<Row<LoopConfig>>({
    loop_row("description", kWaits, [](const LoopConfig& l) { return l.description; }),
    loop_row("area", kWaits, [](const LoopConfig& l) { return l.area; }),
    loop_row("cascade.master", kWaits, [](const LoopConfig& l) { return l.master; }),
    loop_row("sample_time", kKept, [](const LoopConfig& l) { return l.sample_time_s; }),
    loop_row("process_variable.unit", kKept, [](const LoopConfig& l) { return l.pv_unit; }),
    loop_row("process_variable.range", kKept,
             [](const LoopConfig& l) { return Range{l.pv.low, l.pv.high}; }),
    loop_row("process_variable.max_age", kApplied,
             [](const LoopConfig& l) { return l.pv.max_age_s; }),
    loop_row("process_variable.range_margin", kApplied,
             [](const LoopConfig& l) { return l.pv.range_margin; }),
    loop_row("process_variable.frozen_after", kApplied,
             [](const LoopConfig& l) {
               return FrozenAfter{l.pv.frozen_after_s, l.pv.frozen_acts};
             }),
    loop_row("process_variable.max_held", kApplied,
             [](const LoopConfig& l) { return l.pv.max_held_s; }),
    loop_row("controller.action", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.action; }),
    loop_row("controller.kp", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.gains.kp; }),
    loop_row("controller.ki", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.gains.ki; }),
    loop_row("controller.kd", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.gains.kd; }),
    loop_row("controller.derivative_filter", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.gains.derivative_filter_s; }),
    loop_row("controller.anti_windup", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.anti_windup; }),
    loop_row("controller.tracking_time", kApplied,
             [](const LoopConfig& l) { return l.controller.pid.tracking_time_s; }),
    loop_row("controller.output.unit", kKept, [](const LoopConfig& l) { return l.co_unit; }),
    loop_row("controller.output.range", kKept,
             [](const LoopConfig& l) {
               return Range{l.controller.pid.output_low, l.controller.pid.output_high};
             }),
    loop_row("controller.output.limits", kApplied,
             [](const LoopConfig& l) {
               return Range{l.controller.output.low, l.controller.output.high};
             }),
    loop_row("controller.output.rate_limit", kApplied,
             [](const LoopConfig& l) { return l.controller.output.rate_per_s; }),
    loop_row("controller.output.deadband", kApplied,
             [](const LoopConfig& l) { return l.controller.output.deadband; }),
    loop_row("controller.set_point.limits", kApplied,
             [](const LoopConfig& l) {
               return Range{l.controller.set_point.low, l.controller.set_point.high};
             }),
    loop_row("controller.set_point.ramp.up", kApplied,
             [](const LoopConfig& l) { return l.controller.set_point.rate_up_per_s; }),
    loop_row("controller.set_point.ramp.down", kApplied,
             [](const LoopConfig& l) { return l.controller.set_point.rate_down_per_s; }),
    loop_row("controller.set_point_tracks_in_manual", kApplied,
             [](const LoopConfig& l) { return l.controller.set_point_tracks_in_manual; }),
    loop_row("controller.compensator", kApplied,
             [](const LoopConfig& l) { return l.controller.compensator; }),
    loop_row("controller.jacket.form", kApplied,
             [](const LoopConfig& l) { return l.controller.jacket.form; }),
    loop_row("controller.jacket.shadow", kApplied,
             [](const LoopConfig& l) { return l.controller.jacket.shadow; }),
    loop_row("controller.jacket.ks", kApplied,
             [](const LoopConfig& l) { return l.controller.jacket.gain_per_s; }),
    loop_row("controller.jacket.dead_zone", kApplied,
             [](const LoopConfig& l) { return l.controller.jacket.dead_zone; }),
    loop_row("controller.jacket.max_mean_error", kApplied,
             [](const LoopConfig& l) { return l.controller.jacket.max_mean_error; }),
    loop_row("controller.jacket.mean_error_time", kApplied,
             [](const LoopConfig& l) { return l.controller.jacket.mean_error_time_s; }),
    loop_row("controller.jacket.valve_position", kKept,
             [](const LoopConfig& l) { return l.valve_position; }),
    loop_row("start", kWaits,
             [](const LoopConfig& l) {
               return std::tuple(l.start.mode, l.start.set_point, l.start.output,
                                 l.start.after_restart);
             }, kNextStart),
    loop_row("safe_actions.stop", kApplied, [](const LoopConfig& l) { return l.safety.on_stop; }),
    loop_row("safe_actions.bad_pv", kApplied,
             [](const LoopConfig& l) { return l.safety.on_bad_pv; }),
    loop_row("safe_actions.bad_pv.hold_for", kApplied,
             [](const LoopConfig& l) { return l.safety.bad_pv_hold_s; }),
    loop_row("safe_actions.output_lost", kApplied,
             [](const LoopConfig& l) { return l.safety.on_output_lost; }),
    loop_row("safe_actions.enable_open", kApplied,
             [](const LoopConfig& l) { return l.safety.on_enable_open; }),
    loop_row("safe_actions.late_cycle", kApplied,
             [](const LoopConfig& l) { return l.safety.on_late_cycle; }),
    loop_row("safe_actions.not_finite", kApplied,
             [](const LoopConfig& l) { return l.safety.on_not_finite; }),
    loop_row("safe_actions.uncertain_pv", kApplied,
             [](const LoopConfig& l) {
               return std::string(l.safety.uncertain_is_good ? "good" : "bad");
             }),
    loop_row("safe_actions.late_cycle_periods", kApplied,
             [](const LoopConfig& l) { return l.safety.late_cycle_periods; }),
    loop_row("safe_actions.recovery", kApplied,
             [](const LoopConfig& l) { return l.safety.recovery; }),
    loop_row("safe_actions.recovery_delay", kApplied,
             [](const LoopConfig& l) { return l.safety.recovery_delay_s; }),
    loop_row("recording.enabled", kWaits, [](const LoopConfig& l) { return l.recording.enabled; }),
    loop_row("recording.limit_mb", kWaits,
             [](const LoopConfig& l) { return l.recording.limit_bytes / 1'000'000; }),
    loop_row("alarms.normal_mode", kWaits,
             [](const LoopConfig& l) { return l.alarms.process.normal_mode; }),
    loop_row("alarms", kWaits, [](const LoopConfig& l) { return alarms_without_mode(l); }),
    loop_row("monitor.overlap", kWaits, [](const LoopConfig& l) { return l.monitor.overlap; }),
    loop_row("monitor.decimation", kWaits,
             [](const LoopConfig& l) { return l.monitor.decimation; }),
    loop_row("monitor.routine", kWaits, [](const LoopConfig& l) { return l.monitor.routine; }),
    loop_row("monitor.specialists", kWaits,
             [](const LoopConfig& l) { return l.monitor.specialists; }),
    loop_row("monitor.twin", kWaits, [](const LoopConfig& l) { return l.monitor.twin; }),
    loop_row("monitor.corrective_action", kWaits,
             [](const LoopConfig& l) { return l.monitor.corrective; }),
});

constexpr auto kDaemonRows = std::to_array<Row<DaemonConfig>>({
    daemon_row("log_level", kApplied, [](const DaemonConfig& d) { return d.log_level; }),
    daemon_row("stop_timeout", kApplied, [](const DaemonConfig& d) { return d.stop_timeout_s; }),
    daemon_row("page", kApplied, [](const DaemonConfig& d) { return d.page; }),
    daemon_row("edge", kApplied, [](const DaemonConfig& d) { return d.edge; }),
    daemon_row("real_time.priority", kWaits,
               [](const DaemonConfig& d) { return d.real_time.priority; }),
    daemon_row("real_time.cpu", kWaits, [](const DaemonConfig& d) { return d.real_time.cpu; }),
    daemon_row("real_time.lock_memory", kWaits,
               [](const DaemonConfig& d) { return d.real_time.lock_memory; }),
    daemon_row("accelerate", kWaits, [](const DaemonConfig& d) { return d.accelerate; }),
    daemon_row("runtime_directory", kWaits,
               [](const DaemonConfig& d) { return d.runtime_directory; }),
    daemon_row("state_directory", kWaits, [](const DaemonConfig& d) { return d.state_directory; }),
    daemon_row("recording", kWaits, [](const DaemonConfig& d) { return d.recording; }),
    daemon_row("certificates", kWaits, [](const DaemonConfig& d) { return d.certificates; }),
    daemon_row("alarms.latching", kWaits,
               [](const DaemonConfig& d) { return d.alarms.settings.latching; }),
    daemon_row("alarms.shelve_limit", kWaits,
               [](const DaemonConfig& d) { return d.alarms.settings.shelve_limit_ms / 60'000; }),
    daemon_row("alarms.severe", kWaits,
               [](const DaemonConfig& d) { return d.alarms.severe_percent; }),
    daemon_row("alarms.evidence", kWaits,
               [](const DaemonConfig& d) { return d.alarms.most_evidence; }),
});

constexpr auto kServerRows = std::to_array<Row<config::ModbusServer>>({
    row<config::ModbusServer>("modbus_server.address", kWaits,
                              [](const config::ModbusServer& s) { return s.address; }),
    row<config::ModbusServer>("modbus_server.port", kWaits,
                              [](const config::ModbusServer& s) { return s.port; }),
    row<config::ModbusServer>("modbus_server.unit", kWaits,
                              [](const config::ModbusServer& s) { return s.unit; }),
    row<config::ModbusServer>("modbus_server.word_order", kWaits,
                              [](const config::ModbusServer& s) {
                                return static_cast<int>(s.word_order);
                              }),
    row<config::ModbusServer>("modbus_server.max_clients", kWaits,
                              [](const config::ModbusServer& s) { return s.most_clients; }),
    row<config::ModbusServer>("modbus_server.idle_timeout", kWaits,
                              [](const config::ModbusServer& s) { return s.idle_timeout_s; }),
    row<config::ModbusServer>("modbus_server.request_rate", kWaits,
                              [](const config::ModbusServer& s) { return s.requests_per_second; }),
    row<config::ModbusServer>("modbus_server.writes", kWaits,
                              [](const config::ModbusServer& s) { return s.writes; }),
    row<config::ModbusServer>("modbus_server.clients", kWaits,
                              [](const config::ModbusServer& s) { return s.clients; }),
    row<config::ModbusServer>("modbus_server.master_heartbeat", kWaits,
                              [](const config::ModbusServer& s) {
                                return std::pair(s.master_timeout_s, s.on_master_loss);
                              }),
    row<config::ModbusServer>("modbus_server.serial", kWaits,
                              [](const config::ModbusServer& s) { return s.serial; }),
});
// clang-format on

template <class Config, std::size_t N>
void compare(const std::array<Row<Config>, N>& rows, const Config& running, const Config& wanted,
             std::vector<KeyChange>& found) {
  for (const Row<Config>& row : rows) {
    if (!row.differs(running, wanted)) continue;
    Change change{row.key, row.text(running), row.text(wanted), row.why};
    if (change.from == change.to) change.from = change.to = {};
    found.push_back({std::move(change), row.effect});
  }
}

// --- io ---

Range pv_range(const LoopConfig& loop) { return {loop.pv.low, loop.pv.high}; }
Range co_range(const LoopConfig& loop) {
  return {loop.controller.pid.output_low, loop.controller.pid.output_high};
}

// Ignores a value of `io` that is derived from another key in both configurations.
template <class T>
void disregard(T& a, T& b, const T& a_follows, const T& b_follows) {
  if (a == a_follows && b == b_follows) a = b;
}

template <class Stage>
void disregard_range(Stage& a, Stage& b, const Range& a_follows, const Range& b_follows) {
  if (Range{a.low, a.high} != a_follows || Range{b.low, b.high} != b_follows) return;
  a.low = b.low;
  a.high = b.high;
}

std::int64_t period_ns(const LoopConfig& loop) { return std::llround(loop.sample_time_s * 1e9); }

using Changes = std::vector<Change>;

// Reports the key where the operator changed it: in links or in io.
void compare_link(hal::modbus::LinkSettings& a, const hal::modbus::LinkSettings& b,
                  Changes& changes) {
  if (a == b || a.name != b.name) return;
  const std::string key = "links." + b.name;
  if (changes.empty() || changes.back().key != key) changes.push_back({key, {}, {}, kMeaning});
  a = b;
}

// Ignores max_age of the bus, which keeps its value of the start. The loop's own check uses the new
// one.
void disregard_max_age(hal::modbus::PointSettings& a, const hal::modbus::PointSettings& b) {
  a.max_age_ns = b.max_age_ns;
}

void disregard_derived(hal::modbus::LoopModbusSettings& a, hal::modbus::LoopModbusSettings& b,
                       const LoopConfig& running, const LoopConfig& wanted, Changes& changes) {
  compare_link(a.transmitter_link, b.transmitter_link, changes);
  compare_link(a.positioner_link, b.positioner_link, changes);
  disregard_range(a.output, b.output, co_range(running), co_range(wanted));
  disregard_max_age(a.process_variable, b.process_variable);
  disregard_max_age(a.command, b.command);
  if (a.read_back && b.read_back) disregard_max_age(*a.read_back, *b.read_back);
  disregard(a.poll_period_ns, b.poll_period_ns, period_ns(running), period_ns(wanted));
}

void disregard_derived(hal::iio::AnalogSettings& a, hal::iio::AnalogSettings& b,
                       const LoopConfig& running, const LoopConfig& wanted, Changes&) {
  disregard_range(a.process_variable, b.process_variable, pv_range(running), pv_range(wanted));
  disregard_range(a.output, b.output, co_range(running), co_range(wanted));
  if (a.read_back && b.read_back) {
    disregard_range(*a.read_back, *b.read_back, co_range(running), co_range(wanted));
  }
  disregard(a.poll_period_ns, b.poll_period_ns, period_ns(running), period_ns(wanted));
}

void disregard_derived(hal::replay::ReplaySettings& a, hal::replay::ReplaySettings& b,
                       const LoopConfig& running, const LoopConfig& wanted, Changes&) {
  disregard(a.sample_time_s, b.sample_time_s, running.sample_time_s, wanted.sample_time_s);
  if (Range{a.output_low, a.output_high} == co_range(running) &&
      Range{b.output_low, b.output_high} == co_range(wanted)) {
    a.output_low = b.output_low;
    a.output_high = b.output_high;
  }
}

void disregard_derived(config::SimIo& a, config::SimIo& b, const LoopConfig&, const LoopConfig&,
                       Changes& changes) {
  if (a.model != b.model) changes.push_back({"io.model", {}, {}, kMeaning});
  a.model = b.model;
}

void disregard_derived(hal::modbus::ModbusSourceSettings& a, hal::modbus::ModbusSourceSettings& b,
                       const LoopConfig& running, const LoopConfig& wanted, Changes& changes) {
  using Wired = std::optional<hal::modbus::SourcePoint>;
  compare_link(a.process_variable.link, b.process_variable.link, changes);
  compare_link(a.output.link, b.output.link, changes);
  disregard_max_age(a.process_variable.point, b.process_variable.point);
  disregard_max_age(a.output.point, b.output.point);
  for (Wired hal::modbus::ModbusSourceSettings::*point :
       {&hal::modbus::ModbusSourceSettings::set_point, &hal::modbus::ModbusSourceSettings::stem,
        &hal::modbus::ModbusSourceSettings::mode}) {
    if (!(a.*point) || !(b.*point)) continue;
    compare_link((a.*point)->link, (b.*point)->link, changes);
    disregard_max_age((a.*point)->point, (b.*point)->point);
  }
  disregard(a.poll_period_ns, b.poll_period_ns, period_ns(running), period_ns(wanted));
}

void disregard_derived(hal::feed::FeedSettings&, hal::feed::FeedSettings&, const LoopConfig&,
                       const LoopConfig&, Changes&) {}

void disregard_derived(config::OutOfService&, config::OutOfService&, const LoopConfig&,
                       const LoopConfig&, Changes&) {}

const char* backend_name(const config::Io& io) {
  if (std::holds_alternative<config::SimIo>(io)) return "simulated";
  if (std::holds_alternative<hal::modbus::LoopModbusSettings>(io)) return "modbus";
  if (std::holds_alternative<hal::modbus::ModbusSourceSettings>(io)) return "modbus";
  if (std::holds_alternative<hal::feed::FeedSettings>(io)) return "feed";
  return std::holds_alternative<hal::iio::AnalogSettings>(io) ? "analog" : "replay";
}

// Returns whether the controlling system has changed. Such a change alters the meaning of all
// values of the loop.
bool control_differs(const LoopConfig& a, const LoopConfig& b) {
  return config::is_watched(a.io) != config::is_watched(b.io);
}

Changes compare_io(const LoopConfig& running, const LoopConfig& wanted) {
  if (control_differs(running, wanted)) {
    const char* const names[] = {"here", "elsewhere"};
    return {{"control", names[config::is_watched(running.io) ? 1 : 0],
             names[config::is_watched(wanted.io) ? 1 : 0], kMeaning}};
  }
  if (running.io.index() != wanted.io.index()) {
    return {{"io.backend", backend_name(running.io), backend_name(wanted.io), kMeaning}};
  }
  Changes changes;
  std::visit(
      [&](const auto& was) {
        using Settings = std::decay_t<decltype(was)>;
        Settings a = was;
        Settings b = std::get<Settings>(wanted.io);
        disregard_derived(a, b, running, wanted, changes);
        if (!(a == b)) changes.push_back({"io", {}, {}, kMeaning});
      },
      running.io);
  return changes;
}

}  // namespace

std::vector<KeyChange> compare(const LoopConfig& running, const LoopConfig& wanted) {
  std::vector<KeyChange> found;
  compare(kLoopRows, running, wanted, found);
  for (Change& change : compare_io(running, wanted)) {
    found.push_back({std::move(change), Effect::meaning});
  }
  return found;
}

std::vector<KeyChange> compare(const DaemonConfig& running, const DaemonConfig& wanted) {
  std::vector<KeyChange> found;
  const auto waits = [&](const std::string& key) {
    found.push_back({{key, {}, {}, kRestart}, Effect::restart});
  };
  compare(kDaemonRows, running, wanted, found);
  if (running.modbus_server.has_value() != wanted.modbus_server.has_value()) {
    waits("modbus_server");
  } else if (running.modbus_server) {
    compare(kServerRows, *running.modbus_server, *wanted.modbus_server, found);
  }
  if (running.feeders != wanted.feeders) waits("feeders");
  for (const auto& [name, link] : running.links) {
    const auto now = wanted.links.find(name);
    if (now == wanted.links.end() || now->second != link) waits("links." + name);
  }
  for (const auto& [name, link] : wanted.links) {
    if (!running.links.contains(name)) waits("links." + name);
  }
  return found;
}

}  // namespace loopwarden::daemon::reload
