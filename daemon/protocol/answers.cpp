// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/answers.hpp"

#include "daemon/protocol/members.hpp"

namespace loopwarden::protocol {

using nlohmann::json;

PROTOCOL_JSON(Alarm, loop, alarm, state, priority, active, unacknowledged, consequence, about,
              consequence_of, first_out, flaps, raised_ms, changed_ms, times_raised,
              shelved_until_ms, severity_percent, worst_severity_percent)
PROTOCOL_JSON(Incident::Renamed, time_s, from, to)
PROTOCOL_JSON(Incident, id, loop, name, cause, from_s, raised_s, confidence, alarms, active,
              unacknowledged, renamed, cleared_s)
PROTOCOL_JSON(Alarms, alarms, incidents, now_ms)
PROTOCOL_JSON(AlarmDesign, loop, alarm, priority, limit, dead_band, unit, on_delay_s, off_delay_s,
              suppressed_by, cause, consequence, action, time_to_act)
PROTOCOL_JSON(AlarmDesigns, alarms)
PROTOCOL_JSON(AlarmFigures::Counted, loop, alarm, count, percent)
PROTOCOL_JSON(AlarmFigures::Stale, loop, alarm, since_ms)
PROTOCOL_JSON(AlarmFigures, from_ms, to_ms, came, per_hour, most_in_10_min, floods, flood_percent,
              priorities, top, chattering, stale)
PROTOCOL_JSON(Explanation, alarm, final_name, raised_ms, ended_ms, verdict, effect, size_percent,
              low_percent, high_percent, confidence, alternatives, gap_closed, agrees, since_s,
              sentence, remedy, next_test, folder)

PROTOCOL_JSON(JournalLine, id, utc_ms, kind, loop, alarm, from, to, severity_percent, peer, what,
              old_, new_, result, reason)
PROTOCOL_JSON(Journal, lines)

PROTOCOL_JSON(Condition, valve, control_performance, actuator, positioner, environment)
PROTOCOL_JSON(LoadRemark, size, since_s)
PROTOCOL_JSON(UntestedRemark, change, for_s, tested)
PROTOCOL_JSON(TwinRemarks, judging, load_outside, controller_not_watched, untested)
PROTOCOL_JSON(RoutineLevel, window_s, windows, verdict, probability, severity_percent, evidence,
              next_in_s)
PROTOCOL_JSON(Monitor, window_state, source, windows, windows_suppressed, probability,
              severity_percent, oscillation_index, oscillation_period_s, variability_percent,
              mean_error_percent, saturated_percent, bridged_cycles, travel_percent_per_hour,
              reversals_per_hour, stick_percent, stick_source, condition, corrective_action,
              hours_automatic, hours_manual, hours_at_limit, twin, routine)
PROTOCOL_JSON(Io, connected, transactions, timeouts, device_exceptions, invalid_replies,
              stale_replies_discarded, reconnects, writes, write_errors, old_commands_withheld)
PROTOCOL_JSON(Recording, rows, dropped, waiting, queue_dropped, bytes, rows_lost, disk_errors,
              last_disk_error, csv_file, csv_error)
PROTOCOL_JSON(Jacket, form, acting, rate, shadow_rate)
PROTOCOL_JSON(Compensator, kind, acting, added, shadow_added, says)
PROTOCOL_JSON(Cycle, period, time_s, sp, pv, co, stem, set_point_wanted, mode, requested_mode,
              fault, pv_quality, pv_reason, pv_limit, pv_age_ms, at_low, at_high, rate_limited,
              output_lost, jacket, compensator, ne107)

PROTOCOL_JSON(Gains, kp, ki, kd)
PROTOCOL_JSON(LoopGains, in_force, file, derivative_filter_s, not_in_file, by, since_ms)
PROTOCOL_JSON(Commissioned, by, since_ms, ends_in_s)
PROTOCOL_LISTED(LoopStatus, name, description, area, master, control, pv_unit, co_unit, pv_range,
                co_range, sample_time_s, io, recording, monitor, alarms, incident, orders_refused,
                position_age_ms, gains, commissioning, out_of_service)
template <>
struct Members<LoopStatus> : WithPart<LoopStatus, Cycle, &LoopStatus::cycle> {};
PROTOCOL_DEFINE(LoopStatus)

PROTOCOL_JSON(Ranges, pv_range, co_range, sp_limits, output_limits)
PROTOCOL_LISTED(LoopAnswer, explanation, ranges)
template <>
struct Members<LoopAnswer> {
  static void put(json& to, const LoopAnswer& answer) {
    Listed<LoopAnswer>::put(to, answer);
    Members<LoopStatus>::put(to, answer.status);
  }
  static void take(const json& from, LoopAnswer& answer) {
    Listed<LoopAnswer>::take(from, answer);
    Members<LoopStatus>::take(from, answer.status);
  }
};
PROTOCOL_DEFINE(LoopAnswer)

PROTOCOL_JSON(Explained, evidence, alarm, cause, consequence, action, time_to_act, explanation,
              monitor, disk_answers, history)
PROTOCOL_JSON(Trend, period, sample_time_s, sp, pv, co, stem, jacket, compensator, mode)
PROTOCOL_JSON(TwinModel, model)
PROTOCOL_JSON(SpecialistView, mse, class_, probability)
PROTOCOL_JSON(JudgedWindow, time_ms, verdict, suppressed, severity_percent, specialists)
PROTOCOL_JSON(Windows, windows)

PROTOCOL_JSON(LoopDescription, tag, description, area, master, control, pv_unit, co_unit,
              sample_time_s, stem, monitor, twin, specialists, recording, simulated, folder,
              pv_range, co_range, sp_limits, output_limits, source, action)
PROTOCOL_JSON(Report, name, loop, kind, from_ms, to_ms, by, asked_ms, state, place, due_ms,
              started_ms, ended_ms, doing, percent, sentence, page)
PROTOCOL_JSON(Reports, reports)
PROTOCOL_JSON(ReportTaken, taken, waiting, name, on_disk)

PROTOCOL_JSON(SocketRights, alarms, control, tuning, reports, tests)
PROTOCOL_JSON(AlarmRules, severe_percent, latching, shelve_limit_min)
PROTOCOL_JSON(LinkInUse, by, transport, host, port, device)
PROTOCOL_JSON(Links, links)
PROTOCOL_JSON(Description, loops, version, config_hash, model_hash, accelerate, started_ms,
              state_directory, page, edge, alarms)

PROTOCOL_JSON(Field, name, table, area, unit, type, writable, low, high, meaning)
PROTOCOL_JSON(LoopRegisters, values, tag)
PROTOCOL_JSON(Registers, loops, box, names, alarm_changes)

PROTOCOL_JSON(Histogram, bins, p50, p99, p99_9, worst, sum)
PROTOCOL_JSON(WaitingKey, key, file, why)
PROTOCOL_JSON(ConfigurationStatus, refused, files_hash, files_in_force, waiting_for_restart,
              waiting_for_output)
PROTOCOL_JSON(JournalStatus, error, file, written, waiting, lost, damaged)
PROTOCOL_JSON(EvidenceStatus, error, removal_error, written, waiting, lost)
PROTOCOL_JSON(ExplanationsStatus, waiting, explained, failed)
PROTOCOL_JSON(MonitorStatus, windows, cycles, dropped, backlog)
PROTOCOL_JSON(SerialServer, open, requests, malformed)
PROTOCOL_JSON(ModbusServer, port, clients, requests, accepted, refused, displaced, malformed,
              serial)
PROTOCOL_JSON(RecorderStatus, disk_wait_s, sync_s, written_bytes, written_mb_per_day,
              write_budget_mb_per_day)
PROTOCOL_JSON(FeederStatus, name, connected, lines, bad_lines, values, unknown_names, doubled,
              out_of_order, connections, silent_s, clock_behind_s)
PROTOCOL_JSON(ConnectionStatus, name, feeder, up, loops, silent_loops, lost)
PROTOCOL_JSON(DaemonStatus, version, config_hash, model_hash, configuration, recorder,
              log_lines_lost, journal, evidence, explanations, monitor, modbus_server, feeders,
              connections, uptime_s, accelerate, real_time_missing, ticks, overruns, skipped_ticks,
              events_dropped, wake_up_us, work_us)
PROTOCOL_JSON(Status, loops, daemon)

PROTOCOL_JSON(OrderTaken, order, sample_time_s)
PROTOCOL_JSON(Commissioning, session)
PROTOCOL_JSON(InForce, set_point, output, mode, gains)
PROTOCOL_JSON(OrderOutcome, on_disk, why, now)
PROTOCOL_LISTED(OrderState, state)
template <>
struct Members<OrderState> : WithPart<OrderState, OrderOutcome, &OrderState::outcome> {};
PROTOCOL_DEFINE(OrderState)
PROTOCOL_JSON(AlarmActed, on_disk, alarm)
PROTOCOL_JSON(IncidentActed, on_disk, incident)
PROTOCOL_JSON(AcknowledgedAlarm, loop, alarm)
PROTOCOL_JSON(AllAcknowledged, acknowledged, on_disk)
PROTOCOL_JSON(Vetoed, on_disk)
PROTOCOL_JSON(OutcomeKept, said, on_disk)
PROTOCOL_JSON(Noted, on_disk)
PROTOCOL_JSON(RecordFile, file)
PROTOCOL_JSON(ReloadNumber, reload)
PROTOCOL_JSON(KeyChange, key, from, to, why)
PROTOCOL_JSON(DaemonPlan, file, applied, waiting_for_restart)
PROTOCOL_JSON(LoopPlan, loop, file, decision, file_hash, file_time_s, applied, waiting_for_output,
              waiting_for_restart)
PROTOCOL_JSON(ReloadPlan, daemon, loops)
PROTOCOL_JSON(Diagnostic, file, level, key, message, line, column)
PROTOCOL_JSON(ReloadOutcome, outcome, dry_run, on_disk, take_file_needed, not_now, lines,
              diagnostics, config_hash, why, plan)
PROTOCOL_LISTED(ReloadState, state)
template <>
struct Members<ReloadState> : WithPart<ReloadState, ReloadOutcome, &ReloadState::outcome> {};
PROTOCOL_DEFINE(ReloadState)

}  // namespace loopwarden::protocol
