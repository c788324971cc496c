// SPDX-License-Identifier: Apache-2.0
// Answers of the daemon on its sockets: one struct per answer, and one per part of an answer. Words
// are those of to_text() of the model's enumerations. daemon/console/README.md explains them.
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
  std::string about{};     // of the box: what the alarm names, such as the lost connection
  bool active = false, unacknowledged = false;
  bool consequence = false;      // caused by another alarm that is active
  std::string consequence_of{};  // name of that alarm
  bool first_out = false;        // first of several process alarms of the loop
  std::uint64_t flaps = 0;  // process alarms: number of times it was raised, see process_watch.hpp
  std::int64_t raised_ms = 0, changed_ms = 0;
  std::uint64_t times_raised = 0;
  std::int64_t shelved_until_ms = 0;
  double severity_percent = kNone, worst_severity_percent = kNone;
};

// One change of a loop, with all valve alarms that the change raised. Times are s since 1970 (UTC).
struct Incident {
  std::string id{}, loop{}, name{}, cause{};
  double from_s = kNone, raised_s = kNone;
  double confidence = kNone;  // of the explanation that gave the name; null: an alarm gave the name
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
  std::vector<Incident> incidents{};  // the newest incident per loop
  std::int64_t now_ms = 0;
};

// Remarks of a loop's twin in addition to its alarm. Times are times of the loop.
struct LoadRemark {
  double size = kNone;  // PV units
  double since_s = kNone;
};

struct UntestedRemark {
  std::string change{};
  double for_s = kNone;
  bool tested = false;  // true: tested before that time; false: not tested since the start
};

struct TwinRemarks {
  std::string judging{};  // here, settling, outside
  std::optional<LoadRemark> load_outside{};
  // reason; empty: the controller is watched, or the loop runs here
  std::string controller_not_watched{};
  std::vector<UntestedRemark> untested{};
};

// The design of an alarm: its limits and delays, and the texts for the operator.
struct AlarmDesign {
  std::string loop{}, alarm{}, priority{};
  double limit = kNone, dead_band = kNone;  // PV units; for rate_of_change PV units/s
  std::string unit{};
  double on_delay_s = kNone, off_delay_s = kNone;  // null for valve alarms
  std::vector<std::string> suppressed_by{};
  std::string cause{}, consequence{}, action{}, time_to_act{};
};

struct AlarmDesigns {
  std::vector<AlarmDesign> alarms{};
};

// Figures of alarm performance (model/alarm/alarm_figures.hpp). Times are ms since 1970 (UTC).
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
  std::int64_t from_ms = 0, to_ms = 0;  // the part of the requested period that the journal covers
  std::uint64_t came = 0;
  double per_hour = 0.0;
  std::uint64_t most_in_10_min = 0, floods = 0;
  double flood_percent = 0.0;
  std::map<std::string, std::uint64_t> priorities{};  // count of raised alarms by priority
  std::vector<Counted> top{}, chattering{};
  std::vector<Stale> stale{};  // active for more than a day
};

// The cause of an alarm, as found by the gap workflow.
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
  std::string sentence{}, remedy{}, next_test{}, folder{};
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

// Routine evidence for one length of window, see docs/reference/alarms.md.
struct RoutineLevel {
  double window_s = 0.0;      // length of one window
  std::uint64_t windows = 0;  // judged since the start
  // Newest judgement: an effect, or the reason for no effect. Empty: not judged yet.
  std::string verdict{};
  double probability = kNone;       // probability of a valve effect, from the newest judgement
  double severity_percent = kNone;  // % of the CO span, if the verdict is an effect
  double evidence = 0.0;            // accumulated; at 1 the alarm is raised
  double next_in_s = kNone;         // time in automatic with a good PV until the next judgement
};

struct Monitor {
  std::string window_state{};
  // watched loops: values that the source reports only on change, and what that hides
  std::string source{};
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
  std::optional<TwinRemarks> twin{};    // nullopt: the loop has no twin
  std::vector<RoutineLevel> routine{};  // shortest windows first; empty: no routine evidence
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
  std::string says{};                          // planned_moves: present action and its reason
};

// Values of the newest cycle.
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

// Gains of the parallel form: CO units/PV unit, with s.
struct Gains {
  double kp = kNone, ki = kNone, kd = kNone;
};

struct LoopGains {
  Gains in_force{}, file{};  // `file`: gains after a restart
  double derivative_filter_s = kNone;
  bool not_in_file = false;
  std::string by{};  // user who set gains that are not in the file; empty: unknown
  std::int64_t since_ms = 0;
};

// The session that commissions a loop. The loop is out of service for all other users.
struct Commissioned {
  std::string by{};
  std::int64_t since_ms = 0;
  double ends_in_s = 0.0;  // without a further request; 0: the loop goes to its stop action
};

struct LoopStatus {
  std::string name{}, description{}, pv_unit{}, co_unit{};
  std::string control{"here"};   // or elsewhere: another controller runs the loop
  std::string area{}, master{};  // path; tag of the loop that writes the set point, or empty
  Range pv_range{}, co_range{};
  double sample_time_s = 0.0;
  Io io{};
  Recording recording{};
  Monitor monitor{};
  std::map<std::string, Alarm> alarms{};  // by name
  std::optional<Incident> incident{};     // the newest
  std::uint64_t orders_refused = 0;
  double position_age_ms = kNone;
  std::optional<LoopGains> gains{};  // nullopt: another controller holds the gains
  std::optional<Commissioned> commissioning{};
  std::optional<std::string> out_of_service{};  // first error in the loop's files
  // its members are written among the loop's; nullopt: no cycle has run yet
  std::optional<Cycle> cycle{};
};

struct Ranges {
  Range pv_range{}, co_range{}, sp_limits{}, output_limits{};
};

struct LoopAnswer {
  LoopStatus status{};  // its members are written in the answer itself
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

// One value per cycle.
struct Trend {
  std::vector<std::uint64_t> period{};
  double sample_time_s = 0.0;
  std::vector<double> sp{}, pv{}, co{}, stem{}, jacket{}, compensator{};
  std::vector<std::string> mode{};
};

// The loop's twin, as a file of a loop model.
struct TwinModel {
  std::optional<std::string> model{};  // nullopt: the loop has no twin
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

// --- constant between two reloads ---

struct LoopDescription {
  std::string tag{}, description{}, area{}, master{}, control{"here"}, pv_unit{}, co_unit{};
  double sample_time_s = 0.1;
  bool stem = false, monitor = false, twin = false;
  std::vector<std::string> specialists{};
  bool recording = false, simulated = false;
  std::string folder{};  // folder of the loop's segments
  Range pv_range{}, co_range{}, sp_limits{}, output_limits{};
  std::string source{};  // feeder or link that gives PV; empty: none
  Maybe<std::string>
      action{};  // direct or reverse, in force; absent: another controller runs the loop
};

struct SocketRights {
  bool alarms = false, control = false, tuning = false, reports = false, tests = false;
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

// A Modbus line or address that the daemon uses. It is fixed at the start of the daemon.
struct LinkInUse {
  std::string by{};         // owners by name, such as FIC-101
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
  std::string name{}, loop{}, kind{};  // gap, commission, survey, diagnose, receipt
  std::int64_t from_ms = 0, to_ms = 0;
  std::string by{};
  std::int64_t asked_ms = 0;
  std::string state{};                   // waiting, running, done, failed
  std::optional<std::uint64_t> place{};  // position in the queue, from 1; only while it waits
  std::optional<std::int64_t> due_ms{};  // it waits for this time, at which its record ends
  std::optional<std::int64_t> started_ms{}, ended_ms{};
  std::string doing{};  // present step and its progress; only while it runs
  std::optional<std::uint64_t> percent{};
  std::string sentence{};  // set when it has ended
  std::string page{};      // path below the state directory; empty: no page
};

// Reports, newest first.
struct Reports {
  std::vector<Report> reports{};
};

struct ReportTaken {
  bool taken = false;  // false: the queue is full (`waiting` reports)
  std::uint64_t waiting = 0;
  std::string name{};
  bool on_disk = false;  // whether the journal's line is on the disk
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
  std::vector<std::uint64_t> bins{};  // each bin is twice as wide as the previous one
};

struct WaitingKey {
  std::string key{}, file{}, why{};
};

struct ConfigurationStatus {
  std::string refused{};  // reason; empty: the files in the folder are those that were read last
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
  double sync_s = 0.0;                // between two writes to the disk
  std::uint64_t written_bytes = 0;    // by the daemon since its start
  double written_mb_per_day = kNone;  // in at most the last hour
  double write_budget_mb_per_day = kNone;
};

// A feeder: a client that sends values of watched loops to feed.sock.
struct FeederStatus {
  std::string name{};
  bool connected = false;
  std::uint64_t lines = 0, bad_lines = 0, values = 0, unknown_names = 0;
  std::uint64_t doubled = 0, out_of_order = 0, connections = 0;
  double silent_s = kNone;  // since its newest valid line; null: no line yet
  // how far its clock is behind this host's clock; null: it sends no time
  double clock_behind_s = kNone;
};

// A feeder, or a Modbus link of loops.
struct ConnectionStatus {
  std::string name{};
  bool feeder = false;
  bool up = false;  // connected; a link: at least one loop receives PV
  std::uint64_t loops = 0, silent_loops = 0;
  std::vector<std::string> lost{};  // parts behind it, such as brokers, edge nodes and units
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
  std::vector<ConnectionStatus> connections{};
  double uptime_s = 0.0, accelerate = 1.0;
  std::string real_time_missing{};
  std::uint64_t ticks = 0, overruns = 0, skipped_ticks = 0, events_dropped = 0;
  Histogram wake_up_us{}, work_us{};
};

struct Status {
  std::vector<LoopStatus> loops{};
  DaemonStatus daemon{};
};

// --- results of commands ---

// A command was accepted. It acts from the loop's next cycle on: see OrderState.
struct OrderTaken {
  std::uint64_t order = 0;
  double sample_time_s = 0.1;
};

// A loop that is out of service for all users except the owner of this session.
struct Commissioning {
  std::uint64_t session = 0;
};

// The value in force that differs from the expected one.
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
  std::string state{};  // waiting, done, refused
  // its members are written next to the state; nullopt: it waits
  std::optional<OrderOutcome> outcome{};
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
  std::string said{};  // active alarms of the valve at that time
  bool on_disk = false;
};

struct Noted {
  bool on_disk = false;
};

struct RecordFile {
  std::string file{};  // empty: no file was being written
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
  Maybe<std::uint32_t> file_hash{};   // CRC-32 of the file's text that this plan was made from
  Maybe<std::int64_t> file_time_s{};  // last change of the file, s since 1970
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
  bool take_file_needed = false;  // refused because a user's gains are not in any file
  bool not_now = false;           // refused because a loop is being commissioned
  std::vector<std::string> lines{};
  std::optional<std::vector<Diagnostic>> diagnostics{};
  std::uint32_t config_hash = 0;
  Maybe<std::string> why{};
  Maybe<ReloadPlan> plan{};
};

struct ReloadState {
  std::string state{};  // waiting, reading, taking, done
  std::optional<ReloadOutcome>
      outcome{};  // its members are written next to the state; nullopt: not done yet
};

}  // namespace loopwarden::protocol
