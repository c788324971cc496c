// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/status.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "config/loop_model_writer.hpp"
#include "daemon/journal/incident_text.hpp"
#include "daemon/loops/loop_health.hpp"
#include "model/control/planned_moves_limits.hpp"
#include "model/watch/limits.hpp"

namespace loopwarden::daemon::console {

namespace {

protocol::Io io_of(const hal::IoCounters& c) {
  return {.connected = c.connected,
          .transactions = c.transactions,
          .timeouts = c.timeouts,
          .device_exceptions = c.device_exceptions,
          .invalid_replies = c.invalid_replies,
          .stale_replies_discarded = c.stale_replies_discarded,
          .reconnects = c.reconnects,
          .writes = c.writes,
          .write_errors = c.write_errors,
          .old_commands_withheld = c.old_commands_withheld};
}

const char* source_text(alarm::StickSource source) {
  switch (source) {
    case alarm::StickSource::read_back: return "read-back";
    case alarm::StickSource::ellipse: return "PV and CO";
    case alarm::StickSource::none: break;
  }
  return "none";
}

protocol::Recording recording_of(const RecordingStatus& recording) {
  return {.rows = recording.rows,
          .dropped = recording.dropped,
          .waiting = recording.waiting,
          .queue_dropped = recording.queue_dropped,
          .bytes = recording.segments.bytes,
          .rows_lost = recording.segments.rows_lost,
          .disk_errors = recording.segments.disk_errors,
          .last_disk_error = recording.segments.last_error,
          .csv_file = recording.csv_file,
          .csv_error = recording.csv_error};
}

// Returns the state of planned_moves and its reason, in one line.
std::string says(const control::MovesState& moves) {
  using Phase = control::MovePhase;
  std::string line = moves.shadow ? "in shadow, " : "";
  line += control::to_text(moves.phase);
  switch (moves.phase) {
    case Phase::watching:
      line += moves.waits ? ": engages when PV is to settle near the set point"
                          : fmt::format(": measuring the loop under PI, cycle {} of {} to {}",
                                        moves.cycles_watched,
                                        control::PlannedMovesLimits::kLeastCyclesWatched,
                                        control::PlannedMovesLimits::kMostCyclesWatched);
      break;
    case Phase::probing: line += ": testing whether the stem follows"; break;
    case Phase::resting:
      line += fmt::format(": PV will settle {:.3g} off; threshold for a move {:.3g}",
                          std::abs(moves.expected_offset), moves.action_threshold);
      break;
    case Phase::backing_off:
    case Phase::moving: line += fmt::format(": CO to {:.4g}", moves.output); break;
    case Phase::disengaged: line += fmt::format(": {}", control::to_text(moves.reason)); break;
  }
  if (moves.gain > 0.0) line += fmt::format("; RMS reduced to {:.0f} %", 100.0 * moves.gain);
  return line;
}

// Returns the values of the newest cycle.
protocol::Cycle cycle_of(const record::RecordRow& row, const LoopRuntime& runtime,
                         const rt::LoopSettings& settings) {
  const auto flag = [&](record::RecordFlag bit) { return (row.flags & bit) != 0; };
  // Corrective action may have started them without an entry in the file.
  const std::optional<control::MovesState> moves = runtime.channels->moves.read();
  return {.period = row.period_index,
          .time_s = static_cast<double>(row.period_index) * runtime.config.sample_time_s,
          .sp = row.sp,
          .pv = row.pv,
          .co = row.co,
          .stem = row.stem,
          // The end of a ramp, which the `expect` of a command is compared with.
          .set_point_wanted = runtime.channels->set_point_wanted.load(std::memory_order_relaxed),
          .mode = control::to_text(row.mode),
          .requested_mode = control::to_text(row.requested_mode),
          .fault = control::to_text(row.fault),
          .pv_quality = to_text(row.pv_quality),
          .pv_reason = to_text(row.pv_reason),
          .pv_limit = to_text(row.pv_limit),
          .pv_age_ms = static_cast<double>(row.age_ms),
          .at_low = flag(record::kAtLow),
          .at_high = flag(record::kAtHigh),
          .rate_limited = flag(record::kRateLimited),
          .output_lost = flag(record::kOutputLost),
          .jacket = {.form = config::to_text(row.jacket_form),
                     .acting = flag(record::kJacketActs),
                     .rate = static_cast<double>(row.jacket_rate),
                     .shadow_rate = static_cast<double>(row.jacket_rate_shadow)},
          .compensator = {.kind = control::to_text(moves ? control::CompensatorKind::planned_moves
                                                         : settings.controller.compensator.kind),
                          .acting = flag(record::kCompensatorActs),
                          .added = static_cast<double>(row.compensator),
                          .shadow_added = static_cast<double>(row.compensator_shadow),
                          .says = moves ? says(*moves) : std::string{}},
          .ne107 = {}};
}

// Returns the probability that a specialist gives to its condition.
double probability_of(const supervision::LoggedWindow& window, specialist::Condition condition) {
  const auto p = [&](alarm::AlarmKind kind) {
    return static_cast<double>(window.probability[alarm::index_of(kind)]);
  };
  switch (condition) {
    case specialist::Condition::stiction: return p(alarm::AlarmKind::stiction);
    case specialist::Condition::backlash: return p(alarm::AlarmKind::backlash);
    case specialist::Condition::hysteresis: return p(alarm::AlarmKind::hysteresis);
    case specialist::Condition::low_air_supply: return p(alarm::AlarmKind::low_air_supply);
    case specialist::Condition::other: return p(alarm::AlarmKind::unknown);
    case specialist::Condition::no_fault: break;
  }
  double faults = 0.0;
  for (const float one : window.probability) faults += static_cast<double>(one);
  return std::max(0.0, 1.0 - faults);
}

const char* verdict_text(const supervision::LoggedWindow& window) {
  using Result = alarm::WindowJudgement::Result;
  return window.result == Result::fault ? alarm::to_text(window.fault)
                                        : alarm::to_text(window.result);
}

// Rounds to the six digits of a float.
double rounded(double value) {
  return std::isfinite(value) ? std::stod(fmt::format("{:.6g}", value)) : value;
}

}  // namespace

protocol::Alarm alarm_of(const std::string& loop, alarm::AlarmKind kind,
                         const supervision::AlarmSnapshot& watch) {
  const alarm::Alarm& alarm = watch.alarms.alarm(kind);
  const auto cause = watch.alarms.cause_of(kind);
  const bool outage = watch.alarms.follows_outage(kind);
  const bool follows = alarm.active() && (outage || cause.has_value());
  const alarm::AlarmMemory& memory = alarm.memory();
  const bool has_size = alarm::has_size(kind);
  return {.loop = loop,
          .alarm = alarm::to_text(kind),
          .state = alarm::to_text(alarm.state()),
          .priority = alarm::to_text(watch.priority[alarm::index_of(kind)]),
          .active = alarm.active(),
          .unacknowledged = alarm.unacknowledged(),
          .consequence = follows,
          .consequence_of = !follows ? ""
                            : outage ? watch.outage
                                     : alarm::to_text(*cause),
          .first_out = watch.alarms.first_out(kind),
          .flaps = watch.flaps[alarm::index_of(kind)],
          .raised_ms = memory.raised_ms,
          .changed_ms = memory.changed_ms,
          .times_raised = memory.times_raised,
          .shelved_until_ms = memory.shelved_until_ms,
          .severity_percent = has_size ? memory.severity_percent : protocol::kNone,
          .worst_severity_percent = has_size ? memory.worst_severity_percent : protocol::kNone};
}

protocol::Alarm alarm_of(alarm::BoxAlarm kind, const host::HostAlarms& all) {
  const alarm::Alarm alarm = all.alarms().alarm(kind);
  const alarm::AlarmMemory& memory = alarm.memory();
  return {.loop = alarm::kBox,
          .alarm = alarm::to_text(kind),
          .state = alarm::to_text(alarm.state()),
          .priority = alarm::to_text(all.priority(kind)),
          .about = all.about(kind),
          .active = alarm.active(),
          .unacknowledged = alarm.unacknowledged(),
          .raised_ms = memory.raised_ms,
          .changed_ms = memory.changed_ms,
          .times_raised = memory.times_raised,
          .shelved_until_ms = memory.shelved_until_ms};
}

std::optional<protocol::Incident> incident_of(const std::string& loop,
                                              const supervision::AlarmSnapshot& watch) {
  const alarm::Incident& known = watch.incident.incident();
  if (!known.there()) return std::nullopt;
  const auto seconds = [](std::int64_t ms) { return static_cast<double>(ms) / 1000.0; };
  protocol::Incident incident{
      .id = journal::incident_id(loop, known),
      .loop = loop,
      .name = known.name,
      .cause = known.cause ? effects::to_text(*known.cause) : "unknown",
      .from_s = seconds(known.from_ms),
      .raised_s = seconds(known.opened_ms),
      .confidence = known.confidence,
      .unacknowledged = alarm::unacknowledged(known, watch.alarms),
      .cleared_s = known.ended_ms == 0 ? protocol::kNone : seconds(known.ended_ms)};
  for (const alarm::AlarmKind kind : alarm::kValveAlarms) {
    if (!known.has(kind)) continue;
    incident.alarms.emplace_back(alarm::to_text(kind));
    incident.active = incident.active || watch.alarms.alarm(kind).active();
  }
  for (const alarm::Incident::Renamed& one : known.renamed) {
    incident.renamed.push_back({seconds(one.at_ms), one.from, one.to});
  }
  return incident;
}

protocol::Explanation told(const Explanation& e) {
  return {.alarm = alarm::to_text(e.alarm),
          .final_name = e.final_name ? std::optional<std::string>(alarm::to_text(*e.final_name))
                                     : std::nullopt,
          .raised_ms = e.raised_ms,
          .ended_ms = e.ended_ms,
          .verdict = e.verdict,
          .effect = e.effect,
          .size_percent = e.size_percent,
          .low_percent = e.low_percent,
          .high_percent = e.high_percent,
          .confidence = e.confidence,
          .alternatives = e.alternatives,
          .gap_closed = e.gap_closed,
          .agrees = e.agrees,
          .since_s = e.since_s,
          .sentence = e.sentence,
          .remedy = e.remedy,
          .next_test = e.next_test,
          .folder = e.folder.string()};
}

std::optional<protocol::Explanation> explanation_of(const supervision::AlarmSnapshot& watch,
                                                    alarm::AlarmKind kind) {
  if (const auto& own = watch.explanations[alarm::index_of(kind)]) return told(*own);
  const auto& newest = watch.explanation;
  if (!newest) return std::nullopt;
  // Alarms that joined an incident share its explanation.
  const alarm::Incident& incident = watch.incident.incident();
  const bool same =
      incident.has(kind) && incident.has(newest->alarm) && newest->raised_ms >= incident.opened_ms;
  return same || newest->final_name == kind ? std::optional(told(*newest)) : std::nullopt;
}

// Returns the compression by the source, and the smallest fault that is visible with it.
std::string source_text(const supervision::AlarmSnapshot& watch, const config::LoopConfig& loop) {
  const auto of = [](const char* name, const analysis::ArchivedSignal& kept, double span) {
    if (kept.kind == analysis::ArchiveKind::none) return std::string();
    if (!(kept.deviation > 0.0) || !(span > 0.0)) return fmt::format("{} too seldom to tell", name);
    return fmt::format("{} on change of {:.2g} % of span", name, 100.0 * kept.deviation / span);
  };
  const control::PidSettings& pid = loop.controller.pid;
  const std::string pv = of("PV", watch.source.pv, loop.pv.high - loop.pv.low);
  const std::string co = of("CO", watch.source.co, pid.output_high - pid.output_low);
  if (pv.empty() && co.empty()) return {};
  return fmt::format("reports {}{}{}; {}", pv, pv.empty() || co.empty() ? "" : ", ", co,
                     std::isfinite(watch.sees_from_percent)
                         ? fmt::format("a dead band below {:.2g} % of CO's span is not seen",
                                       watch.sees_from_percent)
                         : "routine evidence can't tell");
}

// Returns the findings of the twin without an alarm.
std::optional<protocol::TwinRemarks> remarks_of(const supervision::AlarmSnapshot& watch) {
  if (!watch.twin) return std::nullopt;
  protocol::TwinRemarks told{.judging = watch::to_text(watch.twin->judging),
                             .controller_not_watched = watch.controller_not_watched};
  if (const auto& load = watch.twin->load) {
    told.load_outside = {.size = load->size, .since_s = load->since_s};
  }
  const auto add = [&](const char* change, const watch::Untested& one) {
    told.untested.push_back({change, one.for_s, one.tested});
  };
  for (std::size_t i = 0; i < watch::kTwinChanges; ++i) {
    add(watch::to_text(static_cast<watch::TwinChange>(i)), watch.twin->untested[i]);
  }
  if (watch.twin->controller) add("controller", *watch.twin->controller);
  return told;
}

std::vector<protocol::RoutineLevel> routine_of(const supervision::AlarmSnapshot& watch) {
  std::vector<protocol::RoutineLevel> levels;
  for (const watch::RoutineWatch::Progress& one : watch.routine) {
    if (one.window_s <= 0.0) continue;
    protocol::RoutineLevel& level = levels.emplace_back();
    level.window_s = one.window_s;
    level.windows = one.windows;
    level.evidence = one.sum / watch::WatchLimits::kRaise;
    level.next_in_s = one.window_s - one.filled_s;
    if (one.windows == 0) continue;
    const bool effect = one.verdict == diagnosis::DiagnosisVerdict::valve_effect;
    level.verdict = effect ? alarm::to_text(one.fault) : diagnosis::to_text(one.verdict);
    level.probability = one.probability;
    if (effect) level.severity_percent = one.severity_percent;
  }
  return levels;
}

protocol::Monitor monitor_of(const supervision::AlarmSnapshot& watch,
                             const config::LoopConfig& loop) {
  const alarm::WindowMeasures& m = watch.measures;
  const analysis::ConditionIndices& condition = watch.condition;
  const bool no_size = watch.judgement.result == alarm::WindowJudgement::Result::fault &&
                       !alarm::has_size(watch.judgement.fault);
  std::map<std::string, double> probability;
  for (const alarm::AlarmKind kind : alarm::kWindowAlarms) {
    probability[alarm::to_text(kind)] = watch.judgement.probability[alarm::index_of(kind)];
  }
  return {.window_state = alarm::to_text(watch.window_state),
          .source = source_text(watch, loop),
          .windows = watch.windows,
          .windows_suppressed = watch.windows_suppressed,
          .probability = std::move(probability),
          .severity_percent = no_size ? protocol::kNone : watch.judgement.severity_percent,
          .oscillation_index = m.oscillation_index,
          .oscillation_period_s = m.period_s,
          .variability_percent = m.variability_percent,
          .mean_error_percent = m.mean_error_percent,
          .saturated_percent = m.saturated_percent,
          .bridged_cycles = m.bridged_cycles,
          .travel_percent_per_hour = m.travel_percent_per_hour,
          .reversals_per_hour = m.reversals_per_hour,
          .stick_percent =
              m.stick_source == alarm::StickSource::none ? protocol::kNone : m.stick_percent,
          .stick_source = source_text(m.stick_source),
          .condition = {.control_performance = condition.control_performance,
                        .valve = condition.valve,
                        .actuator = condition.actuator,
                        .positioner = condition.positioner,
                        .environment = condition.environment},
          .corrective_action = alarm::to_text(watch.corrective),
          .hours_automatic = watch.times.seconds_in(control::Mode::automatic) / 3600.0,
          .hours_manual = watch.times.seconds_in(control::Mode::manual) / 3600.0,
          .hours_at_limit = watch.times.seconds_at_limit() / 3600.0,
          .twin = remarks_of(watch),
          .routine = routine_of(watch)};
}

protocol::JudgedWindow window_of(const supervision::LoggedWindow& window) {
  const bool before_judge = window.state == alarm::WindowState::valid ||
                            window.state == alarm::WindowState::not_enough_movement;
  protocol::JudgedWindow all{.time_ms = window.utc_ms};
  if (window.state != alarm::WindowState::valid) all.suppressed = alarm::to_text(window.state);
  if (!before_judge) return all;
  all.verdict = verdict_text(window);
  if (window.result == alarm::WindowJudgement::Result::fault && alarm::has_size(window.fault)) {
    all.severity_percent = rounded(static_cast<double>(window.severity_percent));
  }
  for (std::size_t i = 0; i < specialist::kConditions; ++i) {
    const auto condition = static_cast<specialist::Condition>(i);
    all.specialists.push_back({.mse = rounded(static_cast<double>(window.errors[i])),
                               .class_ = specialist::to_text(condition),
                               .probability = rounded(probability_of(window, condition))});
  }
  return all;
}

protocol::JournalLine line_of(const journal::JournalRow& row) {
  const journal::JournalEntry& e = row.entry;
  return {.id = row.id,
          .utc_ms = e.utc_ms,
          .kind = journal::to_text(e.kind),
          .loop = e.loop,
          .alarm = e.alarm,
          .from = e.from,
          .to = e.to,
          .severity_percent = e.severity_percent.value_or(protocol::kNone),
          .peer = e.peer,
          .what = e.what,
          .old_ = e.old_value,
          .new_ = e.new_value,
          .result = e.result,
          .reason = e.reason};
}

protocol::Ranges ranges_of(const rt::LoopSettings& settings) {
  const control::ControllerSettings& controller = settings.controller;
  return {.pv_range = {settings.pv_check.low, settings.pv_check.high},
          .co_range = {controller.pid.output_low, controller.pid.output_high},
          .sp_limits = {controller.set_point.low, controller.set_point.high},
          .output_limits = {controller.output.low, controller.output.high}};
}

const char* control_of(const LoopRuntime& loop) { return loop.watched() ? "elsewhere" : "here"; }

namespace {

protocol::Gains told(const control::PidGains& gains) { return {gains.kp, gains.ki, gains.kd}; }

protocol::LoopGains gains_of(const CurrentSettings& current, const control::PidGains& in_force) {
  protocol::LoopGains gains{.in_force = told(in_force),
                            .file = told(in_force),
                            .derivative_filter_s = in_force.derivative_filter_s};
  if (const auto ordered = current.gains_not_in_file()) {
    gains.file = told(ordered->file);
    gains.not_in_file = true;
    gains.by = ordered->author.by;
    gains.since_ms = ordered->author.utc_ms;
  }
  return gains;
}

}  // namespace

protocol::LoopStatus loop_status(const Plant& plant, std::size_t index) {
  const LoopRuntime& runtime = plant.loops[index];
  const config::LoopConfig& config = runtime.config;
  const rt::LoopSettings settings = runtime.settings->get();
  const protocol::Ranges ranges = ranges_of(settings);
  const supervision::AlarmSnapshot watch = plant.alarms.snapshot(index);
  const auto position_age_ms =
      static_cast<double>(runtime.channels->position_age_ms.load(std::memory_order_relaxed));
  protocol::LoopStatus loop{
      .name = config.name,
      .description = config.description,
      .pv_unit = config.pv_unit,
      .co_unit = config.co_unit,
      .control = control_of(runtime),
      .area = config.area,
      .master = config.master,
      .pv_range = ranges.pv_range,
      .co_range = ranges.co_range,
      .sample_time_s = config.sample_time_s,
      .io = io_of(runtime.device().counters()),
      .recording = recording_of(plant.historian.status(index)),
      .monitor = monitor_of(watch, config),
      .orders_refused = runtime.channels->orders_refused.load(std::memory_order_relaxed),
      .position_age_ms = position_age_ms < 0.0 ? protocol::kNone : position_age_ms};
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
    if (!watch.alarms.fitted(kind)) continue;
    loop.alarms[alarm::to_text(kind)] = alarm_of(config.name, kind, watch);
  }
  loop.incident = incident_of(config.name, watch);
  if (const std::string* why = config::out_of_service(config.io)) loop.out_of_service = *why;
  if (const auto holder = runtime.commissioning->holder()) {
    loop.commissioning = {holder->by, holder->since_ms, holder->ends_in_s};
  }
  if (!runtime.watched()) {
    loop.gains = gains_of(*runtime.settings, settings.controller.pid.gains);
  }
  record::RecordRow row;
  if (!plant.historian.latest(index, row)) return loop;
  loop.cycle = cycle_of(row, runtime, settings);
  loop.cycle->ne107 = alarm::to_text(health_of(config, row, watch, plant.severe_percent));
  return loop;
}

}  // namespace loopwarden::daemon::console
