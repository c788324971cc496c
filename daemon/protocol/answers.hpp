// SPDX-License-Identifier: Apache-2.0
// What the daemon answers on its sockets: one struct for each answer, and for each part of one. Words are those of to_text() of
// the model's enumerations. daemon/console/README.md says what they mean.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/protocol/message.hpp"

namespace loopwarden::protocol {

using Range = std::array<double, 2>;  // lowest, highest

// --- alarms ---

struct Alarm {
  std::string loop{}, alarm{}, state{};
  std::string priority{};  // low, medium, high, critical
  bool active = false, unacknowledged = false;
  bool consequence = false;      // of another alarm that is active
  std::string consequence_of{};  // which
  bool first_out = false;        // of several process alarms of the loop the one that came first
  std::uint64_t flaps = 0;       // of a process alarm: how often it came, as in process_watch.hpp
  std::int64_t raised_ms = 0, changed_ms = 0;
  std::uint64_t times_raised = 0;
  std::int64_t shelved_until_ms = 0;
  double severity_percent = kNone, worst_severity_percent = kNone;
};

// One change of a loop, with all valve alarms that it raised. Times are s since 1970 (UTC).
struct Incident {
  std::string id{}, loop{}, name{}, cause{};
  double from_s = kNone, raised_s = kNone;
  double confidence = kNone;  // of the explanation that gave the name; null: an alarm gave it
  std::vector<std::string> alarms{};
  bool active = false, unacknowledged = false;
  struct Renamed {
    double time_s = kNone;
    std::string from{}, to{};
  };
  std::vector<Renamed> renamed{};
  double cleared_s = kNone;
};

struct Alarms {
  std::vector<Alarm> alarms{};
  std::vector<Incident> incidents{};  // the newest of each loop that has had one
  std::int64_t now_ms = 0;
};

// What a loop's twin says beside its alarm; times of the loop.
struct LoadRemark {
  double size = kNone;  // PV units
  double since_s = kNone;
};

struct UntestedRemark {
  std::string change{};
  double for_s = kNone;
  bool tested = false;  // before that; else never since the start
};

struct TwinRemarks {
  std::string judging{};  // here, settling, outside
  std::optional<LoadRemark> load_outside{};
  std::string controller_not_watched{};  // why; empty: it is, or the loop runs here
  std::vector<UntestedRemark> untested{};
};

// An alarm as it is meant: what it waits for, and what a person is told.
struct AlarmDesign {
  std::string loop{}, alarm{}, priority{};
  double limit = kNone, dead_band = kNone;  // PV units; of rate_of_change PV units/s
  std::string unit{};
  double on_delay_s = kNone, off_delay_s = kNone;  // null: a valve alarm's
  std::vector<std::string> suppressed_by{};
  std::string cause{}, consequence{}, action{}, time_to_act{};
};

struct AlarmDesigns {
  std::vector<AlarmDesign> alarms{};
};

// How the alarms did (model/alarm/alarm_figures.hpp). Times are ms since 1970 (UTC).
struct AlarmFigures {
  struct Counted {
    std::string loop{}, alarm{};
    std::uint64_t count = 0;
    double percent = kNone;
  };
  struct Stale {
    std::string loop{}, alarm{};
    std::int64_t since_ms = 0;
  };
  std::int64_t from_ms = 0, to_ms = 0;  // what the journal has of the time asked for
  std::uint64_t came = 0;
  double per_hour = 0.0;
  std::uint64_t most_in_10_min = 0, floods = 0;
  double flood_percent = 0.0;
  std::map<std::string, std::uint64_t> priorities{};  // of what came
  std::vector<Counted> top{}, chattering{};
  std::vector<Stale> stale{};  // on for more than a day
};

// Why an alarm came, by the gap workflow.
struct Explanation {
  std::string alarm{};
  std::optional<std::string> final_name{};
  std::int64_t raised_ms = 0, ended_ms = 0;
  std::string verdict{}, effect{};
  double size_percent = kNone, low_percent = kNone, high_percent = kNone;
  double confidence = kNone;
  std::vector<std::string> alternatives{};
  double gap_closed = kNone;
  bool agrees = false;
  double since_s = kNone;
  std::string sentence{}, remedy{}, folder{};
};

struct JournalLine {
  std::int64_t id = 0, utc_ms = 0;
  std::string kind{}, loop{}, alarm{}, from{}, to{};
  double severity_percent = kNone;
  std::string peer{}, what{}, old_{}, new_{}, result{}, reason{};
};

struct Journal {
  std::vector<JournalLine> lines{};  // newest first
};

// --- one loop ---

struct Condition {
  double control_performance = kNone, valve = kNone, actuator = kNone, positioner = kNone;
  double environment = kNone;
};

// Routine evidence of one length of window, see docs/watch.md.
struct RoutineLevel {
  double window_s = 0.0;      // the length of one window
  std::uint64_t windows = 0;  // judged since the start
  // Of the newest judgement: an effect, or the reason for no effect. Empty: not judged yet.
  std::string verdict{};
  double probability = kNone;       // of a valve effect, by the newest judgement
  double severity_percent = kNone;  // % of the CO span, if the verdict is an effect
  double evidence = 0.0;            // gathered so far; from 1 on the alarm is raised
  double next_in_s = kNone;         // until the next judgement, in automatic with a good PV
};

struct Monitor {
  std::string window_state{};
  std::string source{};  // of a watched loop: what it reports on change alone, and what that hides
  std::uint64_t windows = 0, windows_suppressed = 0;
  std::map<std::string, double> probability{};  // by alarm
  double severity_percent = kNone;
  double oscillation_index = 0.0, oscillation_period_s = 0.0, variability_percent = 0.0;
  double mean_error_percent = 0.0, saturated_percent = 0.0;
  std::uint64_t bridged_cycles = 0;
  double travel_percent_per_hour = 0.0, reversals_per_hour = 0.0;
  double stick_percent = kNone;
  std::string stick_source{};
  Condition condition{};
  std::string corrective_action{};
  double hours_automatic = 0.0, hours_manual = 0.0, hours_at_limit = 0.0;
  std::optional<TwinRemarks> twin{};    // nothing: it has none
  std::vector<RoutineLevel> routine{};  // the shortest windows first; empty: not weighed
};

struct Io {
  bool connected = false;
  std::uint64_t transactions = 0, timeouts = 0, device_exceptions = 0, invalid_replies = 0;
  std::uint64_t stale_replies_discarded = 0, reconnects = 0, writes = 0, write_errors = 0;
  std::uint64_t old_commands_withheld = 0;
};

struct Recording {
  std::uint64_t rows = 0, dropped = 0, waiting = 0, queue_dropped = 0, bytes = 0, rows_lost = 0;
  std::uint64_t disk_errors = 0;
  std::string last_disk_error{}, csv_file{}, csv_error{};
};

struct Jacket {
  std::string form = "off";
  bool acting = false;
  double rate = kNone, shadow_rate = kNone;  // CO units/s
};

struct Compensator {
  std::string kind = "none";
  bool acting = false;
  double added = kNone, shadow_added = kNone;  // CO units
  std::string says{};                          // planned_moves: what it does, and why
};

// What the newest cycle says.
struct Cycle {
  std::uint64_t period = 0;
  double time_s = 0.0;
  double sp = kNone, pv = kNone, co = kNone, stem = kNone;
  double set_point_wanted = kNone;
  std::string mode = "-", requested_mode = "-", fault = "starting";
  std::string pv_quality = "good", pv_reason = "none", pv_limit = "none";
  double pv_age_ms = kNone;
  bool at_low = false, at_high = false, rate_limited = false, output_lost = false;
  Jacket jacket{};
  Compensator compensator{};
  std::string ne107 = "-";
};

// Of the parallel form: CO units/PV unit, with s.
struct Gains {
  double kp = kNone, ki = kNone, kd = kNone;
};

struct LoopGains {
  Gains in_force{}, file{};  // `file`: what a restart takes
  double derivative_filter_s = kNone;
  bool not_in_file = false;
  std::string by{};  // who has set what is not in the file; empty: not known
  std::int64_t since_ms = 0;
};

// Who commissions the loop: it is out of service for everybody else.
struct Commissioned {
  std::string by{};
  std::int64_t since_ms = 0;
  double ends_in_s = 0.0;  // without a sign of life; 0: it goes to its stop action
};

struct LoopStatus {
  std::string name{}, description{}, pv_unit{}, co_unit{};
  std::string control{"here"};  // or elsewhere: another controller has the loop
  Range pv_range{}, co_range{};
  double sample_time_s = 0.0;
  Io io{};
  Recording recording{};
  Monitor monitor{};
  std::map<std::string, Alarm> alarms{};  // by name
  std::optional<Incident> incident{};     // the newest
  std::uint64_t orders_refused = 0;
  double position_age_ms = kNone;
  std::optional<LoopGains> gains{};  // nothing: another controller has them
  std::optional<Commissioned> commissioning{};
  std::optional<std::string> out_of_service{};  // its files have errors: the first one
  std::optional<Cycle> cycle{};  // its members stand among the loop's; nothing: none has run yet
};

struct Ranges {
  Range pv_range{}, co_range{}, sp_limits{}, output_limits{};
};

struct LoopAnswer {
  LoopStatus status{};  // its members stand in the answer itself
  Ranges ranges{};
  std::optional<Explanation> explanation{};  // the newest
};

struct Explained {
  std::optional<std::string> evidence{};  // folder
  Alarm alarm{};
  std::string cause{}, consequence{}, action{}, time_to_act{};
  std::optional<Explanation> explanation{};
  Monitor monitor{};
  bool disk_answers = true;
  std::vector<JournalLine> history{};
};

// One value a cycle.
struct Trend {
  std::vector<std::uint64_t> period{};
  double sample_time_s = 0.0;
  std::vector<double> sp{}, pv{}, co{}, stem{}, jacket{}, compensator{};
  std::vector<std::string> mode{};
};

// The loop's twin, as a file of a loop model.
struct TwinModel {
  std::optional<std::string> model{};  // nothing: it has none
};

struct SpecialistView {
  double mse = kNone;
  std::string class_{};
  double probability = kNone;
};

struct JudgedWindow {
  std::int64_t time_ms = 0;
  std::optional<std::string> verdict{}, suppressed{};
  double severity_percent = kNone;
  std::vector<SpecialistView> specialists{};
};

struct Windows {
  std::vector<JudgedWindow> windows{};  // oldest first
};

// --- what is the same from one reload to the next ---

struct LoopDescription {
  std::string tag{}, description{}, area{}, control{"here"}, pv_unit{}, co_unit{};
  double sample_time_s = 0.1;
  bool stem = false, monitor = false, twin = false;
  std::vector<std::string> specialists{};
  bool recording = false, simulated = false;
  std::string folder{};  // of its segments
  Range pv_range{}, co_range{}, sp_limits{}, output_limits{};
  Maybe<std::string>
      action{};  // direct or reverse, in force; absent: another controller has the loop
};

struct SocketRights {
  bool alarms = false, control = false, tuning = false, reports = false;
};

struct AlarmRules {
  double severe_percent = kNone;
  bool latching = false;
  std::int64_t shelve_limit_min = 0;
};

struct Description {
  std::vector<LoopDescription> loops{};
  std::string version{};
  std::uint32_t config_hash = 0, model_hash = 0;
  double accelerate = 1.0;
  std::int64_t started_ms = 0;
  std::string state_directory{};
  SocketRights page{}, edge{};
  AlarmRules alarms{};
};

// A Modbus line or address on which the daemon works, as since its start.
struct LinkInUse {
  std::string by{};         // in words, such as FIC-101
  std::string transport{};  // tcp, rtu
  std::string host{};
  std::uint64_t port = 0;
  std::string device{};
};

struct Links {
  std::vector<LinkInUse> links{};
};

// --- reports of a loop's record ---

struct Report {
  std::string name{}, loop{}, kind{};  // gap, commission, survey, diagnose
  std::int64_t from_ms = 0, to_ms = 0;
  std::string by{};
  std::int64_t asked_ms = 0;
  std::string state{};                   // waiting, running, done, failed
  std::optional<std::uint64_t> place{};  // while it waits, from 1
  std::optional<std::int64_t> started_ms{}, ended_ms{};
  std::string doing{};  // while it runs: what, and how much of that
  std::optional<std::uint64_t> percent{};
  std::string sentence{};  // once it has ended
  std::string page{};      // below the state directory; empty: there is none
};

// Newest first.
struct Reports {
  std::vector<Report> reports{};
};

struct ReportTaken {
  bool taken = false;  // false: `waiting` do already
  std::uint64_t waiting = 0;
  std::string name{};
  bool on_disk = false;  // the journal's line
};

// --- the register map ---

struct Field {
  std::string name{}, table{}, area{}, unit{}, type{};
  bool writable = false;
  double low = kNone, high = kNone;
  std::string meaning{};
};

struct LoopRegisters {
  std::string tag{};
  std::vector<double> values{};
};

struct Registers {
  std::vector<LoopRegisters> loops{};
  std::vector<double> box{};
  Maybe<std::vector<Field>> names{};
  std::uint64_t alarm_changes = 0;
};

// --- the daemon ---

struct Histogram {
  double p50 = 0.0, p99 = 0.0, p99_9 = 0.0, worst = 0.0, sum = 0.0;  // us
  std::vector<std::uint64_t> bins{};  // each twice as wide as the one before
};

struct WaitingKey {
  std::string key{}, file{}, why{};
};

struct ConfigurationStatus {
  std::string refused{};  // why; empty: the files in the folder are those that were read last
  std::uint32_t files_hash = 0;
  bool files_in_force = false;
  std::vector<WaitingKey> waiting_for_restart{}, waiting_for_output{};
};

struct JournalStatus {
  std::string error{}, file{};
  std::uint64_t written = 0, waiting = 0, lost = 0, damaged = 0;
};

struct EvidenceStatus {
  std::string error{}, removal_error{};
  std::uint64_t written = 0, waiting = 0, lost = 0;
};

struct ExplanationsStatus {
  std::uint64_t explained = 0, failed = 0, waiting = 0;
};

struct MonitorStatus {
  std::uint64_t windows = 0, cycles = 0, dropped = 0, backlog = 0;
};

struct SerialServer {
  bool open = false;
  std::uint64_t requests = 0, malformed = 0;
};

struct ModbusServer {
  std::uint64_t port = 0, clients = 0, requests = 0, accepted = 0, refused = 0, displaced = 0;
  std::uint64_t malformed = 0;
  Maybe<SerialServer> serial{};
};

struct RecorderStatus {
  double disk_wait_s = 0.0;
};

// One that brings values of watched loops to feed.sock.
struct FeederStatus {
  std::string name{};
  bool connected = false;
  std::uint64_t lines = 0, bad_lines = 0, values = 0, unknown_names = 0;
  std::uint64_t doubled = 0, out_of_order = 0, connections = 0;
  double silent_s = kNone;        // since its newest sound line; null: none yet
  double clock_behind_s = kNone;  // its clock behind this one; null: it sends no time
};

struct DaemonStatus {
  std::string version{};
  std::uint32_t config_hash = 0, model_hash = 0;
  ConfigurationStatus configuration{};
  RecorderStatus recorder{};
  std::uint64_t log_lines_lost = 0;
  JournalStatus journal{};
  EvidenceStatus evidence{};
  ExplanationsStatus explanations{};
  MonitorStatus monitor{};
  std::optional<ModbusServer> modbus_server{};
  std::vector<FeederStatus> feeders{};
  double uptime_s = 0.0, accelerate = 1.0;
  std::string real_time_missing{};
  std::uint64_t ticks = 0, overruns = 0, skipped_ticks = 0, events_dropped = 0;
  Histogram wake_up_us{}, work_us{};
};

struct Status {
  std::vector<LoopStatus> loops{};
  DaemonStatus daemon{};
};

// --- what becomes of orders ---

// Only from the loop's cycle on: see OrderState.
struct OrderTaken {
  std::uint64_t order = 0;
  double sample_time_s = 0.1;
};

// Of a loop that is out of service for everybody but who has this session.
struct Commissioning {
  std::uint64_t session = 0;
};

// The one value in force that was not the expected one.
struct InForce {
  Maybe<double> set_point{}, output{};
  Maybe<std::string> mode{};
  Maybe<Gains> gains{};
};

struct OrderOutcome {
  std::string why{};  // empty: done
  std::optional<InForce> now{};
  bool on_disk = false;
};

struct OrderState {
  std::string state{};                    // waiting, done, refused
  std::optional<OrderOutcome> outcome{};  // its members stand beside the state; nothing: it waits
};

struct AlarmActed {
  Alarm alarm{};
  bool on_disk = false;
};

struct IncidentActed {
  Incident incident{};
  bool on_disk = false;
};

struct AcknowledgedAlarm {
  std::string loop{}, alarm{};
};

struct AllAcknowledged {
  std::vector<AcknowledgedAlarm> acknowledged{};
  bool on_disk = false;
};

struct Vetoed {
  bool on_disk = false;
};

struct OutcomeKept {
  std::string said{};  // of the loop's valve at that time
  bool on_disk = false;
};

struct Noted {
  bool on_disk = false;
};

struct RecordFile {
  std::string file{};  // empty: none was being written
};

struct ReloadNumber {
  std::uint64_t reload = 0;
};

struct KeyChange {
  std::string key{};
  Maybe<std::string> from{}, to{}, why{};
};

struct DaemonPlan {
  std::string file{};
  std::vector<KeyChange> applied{}, waiting_for_restart{};
};

struct LoopPlan {
  std::string loop{}, file{}, decision{};
  Maybe<std::uint32_t> file_hash{};  // CRC-32 of the file's text as it was read for this plan
  std::vector<KeyChange> applied{}, waiting_for_output{}, waiting_for_restart{};
};

struct ReloadPlan {
  DaemonPlan daemon{};
  std::vector<LoopPlan> loops{};
};

struct Diagnostic {
  std::string file{}, level{}, key{}, message{};
  int line = 0, column = 0;
};

struct ReloadOutcome {
  std::string outcome{};  // in_force, waits, refused
  bool dry_run = false, on_disk = false;
  bool take_file_needed = false;  // refused for a person's gains that no file has
  bool not_now = false;           // refused while a loop is being commissioned
  std::vector<std::string> lines{};
  std::optional<std::vector<Diagnostic>> diagnostics{};
  std::uint32_t config_hash = 0;
  Maybe<std::string> why{};
  Maybe<ReloadPlan> plan{};
};

struct ReloadState {
  std::string state{};  // waiting, reading, taking, done
  std::optional<ReloadOutcome>
      outcome{};  // its members stand beside the state; nothing: not done yet
};

}  // namespace loopwarden::protocol
