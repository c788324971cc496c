// SPDX-License-Identifier: Apache-2.0
// Requests to the daemon, each with the type of its answer. daemon/console/README.md has the table.
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "daemon/protocol/answers.hpp"
#include "daemon/protocol/message.hpp"
#include "daemon/protocol/overview.hpp"

namespace loopwarden::protocol {

// A request that can't be served. Its text is sent to the peer. Reading a request from JSON throws
// it.
class RequestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A request that can't be served now. The same request may succeed some cycles later.
class NotYet : public RequestError {
 public:
  using RequestError::RequestError;
};

struct StatusRequest {
  static constexpr const char* kName = "status";
  using Answer = Status;
};

struct LinksRequest {
  static constexpr const char* kName = "links";
  using Answer = Links;
};

struct DescribeRequest {
  static constexpr const char* kName = "describe";
  using Answer = Description;
};

struct OverviewRequest {
  static constexpr const char* kName = "overview";
  using Answer = Overview;
};

struct AlarmsRequest {
  static constexpr const char* kName = "alarms";
  using Answer = Alarms;
};

// The design of all alarms of one loop, or of all loops, from their files.
struct AlarmDesignRequest {
  static constexpr const char* kName = "alarm_design";
  using Answer = AlarmDesigns;
  Maybe<std::string> loop{};
};

struct AlarmFiguresRequest {
  static constexpr const char* kName = "alarm_figures";
  using Answer = AlarmFigures;
  Maybe<std::uint64_t> hours{};  // period up to now, at most 720; default 24
};

struct LoopRequest {
  static constexpr const char* kName = "loop";
  using Answer = LoopAnswer;
  std::string loop{};
};

struct WindowsRequest {
  static constexpr const char* kName = "windows";
  using Answer = Windows;
  std::string loop{};
};

struct TwinRequest {
  static constexpr const char* kName = "twin";
  using Answer = TwinModel;
  std::string loop{};
};

struct TrendRequest {
  static constexpr const char* kName = "trend";
  using Answer = Trend;
  std::string loop{};
  Maybe<std::uint64_t> from{}, most{};  // period; rows
};

struct RegistersRequest {
  static constexpr const char* kName = "registers";
  using Answer = Registers;
  Maybe<bool> values_only{};
};

struct ExplainRequest {
  static constexpr const char* kName = "explain";
  using Answer = Explained;
  std::string loop{}, alarm{};
};

struct JournalRequest {
  static constexpr const char* kName = "journal";
  using Answer = Journal;
  Maybe<std::string> loop{};
  Maybe<std::uint64_t> most{}, before_id{};
  Maybe<std::string> kind{}, text{};
  Maybe<std::uint64_t> from_ms{}, to_ms{};
};

// The user who sends a command, as reported by the program that uses page.sock or edge.sock.
struct Person {
  Maybe<std::string> user{}, address{};
};

// The values that the sender has seen.
struct Expected {
  Maybe<double> set_point{}, output{};  // NaN: an unknown output
  Maybe<std::string> mode{};
};

struct SetRequest {
  static constexpr const char* kName = "set";
  using Answer = OrderTaken;
  std::string loop{};
  Maybe<double> set_point{}, output{};
  Maybe<std::string> mode{};    // auto, man
  Maybe<std::string> jacket{};  // off, shadow, on
  Maybe<Expected> expect{};
  Maybe<std::string> user{}, address{};
  Maybe<std::uint64_t> session{};  // session of the user who commissions the loop
};

// A small test: the limits of its moves, and those that end it.
struct TestTerms {
  Range pv{}, co{};  // PV units; CO units; outside of them the test ends
  Range moved{};     // limits of SP in PV units, or in manual of the output in CO units
  bool manual = false;
  // Only in manual, on control.sock: moves of any size within `moved`, also during process alarms.
  bool any_size = false;
  double longest_s = 0.0;  // of the loop's time
  std::string plan{};      // for the journal
};

// Takes a loop out of service for commissioning. With the session of the loop, it is a sign of
// life. With `test`, the daemon moves the loop as `move` requests, and restores it at the end.
struct CommissioningRequest {
  static constexpr const char* kName = "commissioning";
  using Answer = Commissioning;
  std::string loop{};
  Maybe<std::uint64_t> session{};
  Maybe<TestTerms> test{};
  Maybe<double> move{};        // SP or output of the test
  Maybe<double> withhold_s{};  // duration for which commands are withheld
  Maybe<bool> end{};
  Maybe<std::string> why{};  // with `end`: why a test ends early
  Maybe<std::string> user{}, address{};
};

// The controller's gains. A reload or a restart replaces them by those of the file.
struct TuneRequest {
  static constexpr const char* kName = "tune";
  using Answer = OrderTaken;
  std::string loop{};
  double kp = kNone, ki = kNone, kd = kNone;
  Maybe<Gains> expect{};  // values that the sender has seen
  Maybe<std::string> user{}, address{};
};

struct OrderRequest {
  static constexpr const char* kName = "order";
  using Answer = OrderState;
  std::string loop{};
  Maybe<std::uint64_t> order{};
};

struct AlarmRequest {
  static constexpr const char* kName = "alarm";
  using Answer = AlarmActed;
  std::string loop{}, alarm{}, action{};  // acknowledge, reset, shelve, unshelve
  Maybe<std::string> reason{};
  Maybe<std::uint64_t> minutes{};
  Maybe<std::string> user{}, address{};
};

// Acknowledges all unacknowledged alarms of an incident.
struct AcknowledgeIncidentRequest {
  static constexpr const char* kName = "acknowledge_incident";
  using Answer = IncidentActed;
  std::string loop{}, incident{};  // its id
  Maybe<std::string> reason{}, user{}, address{};
};

struct AcknowledgeAllRequest {
  static constexpr const char* kName = "acknowledge_all";
  using Answer = AllAcknowledged;
  Maybe<std::string> reason{}, user{}, address{};
};

// The decision of a test that has ended, for the journal.
struct TestResultRequest {
  static constexpr const char* kName = "test_result";
  using Answer = Noted;
  std::string loop{}, explanations{}, decided{};  // "stiction or backlash"; decided: empty: none
  double predicted = kNone, probability = kNone;  // of a right decision; of `decided`
  Maybe<std::string> user{}, address{};
};

struct VetoRequest {
  static constexpr const char* kName = "veto";
  using Answer = Vetoed;
  std::string loop{};
  bool veto = true;
  Maybe<std::string> reason{}, user{}, address{};
};

// Findings of a technician at the valve. other: the cause is not the valve.
inline constexpr std::array kFoundWords{"stiction", "backlash", "air", "nothing", "other"};

// A note that begins with one of these words reports work that is done: a repair, or a change at
// the valve or its positioner without a fault. A receipt compares the records before and after it.
inline constexpr std::string_view kRepaired = "repaired";
inline constexpr std::string_view kChanged = "changed";

struct OutcomeRequest {
  static constexpr const char* kName = "outcome";
  using Answer = OutcomeKept;
  std::string loop{}, found{};
  Maybe<std::string> note{};
};

// A user's note about a loop at a time. It appears on the loop's trend and incidents.
struct NoteRequest {
  static constexpr const char* kName = "note";
  using Answer = Noted;
  std::string loop{}, text{};
  Maybe<std::uint64_t> about_ms{};  // UTC; absent: now
  Maybe<std::string> user{}, address{};
};

// Lists the loop's reports: waiting, running, and ended ones that are kept.
struct ReportsRequest {
  static constexpr const char* kName = "reports";
  using Answer = Reports;
  std::string loop{};
};

struct ReportRequest {
  static constexpr const char* kName = "report";
  using Answer = ReportTaken;
  std::string loop{}, kind{};
  std::uint64_t from_ms = 0, to_ms = 0;  // UTC, within the recorded period
  Maybe<std::string> user{}, address{};
};

struct RecordRequest {
  static constexpr const char* kName = "record";
  using Answer = RecordFile;
  std::string loop{};
  Maybe<std::string> start{};  // name
  Maybe<bool> stop{};
  Maybe<double> at_most_s{};  // with `start`: recording ends by itself after this time
};

struct ReloadRequest {
  static constexpr const char* kName = "reload";
  using Answer = ReloadNumber;
  Maybe<bool> dry_run{};
  Maybe<bool> take_file{};  // reload even if a user's gains are not in the files
};

struct ReloadStateRequest {
  static constexpr const char* kName = "reload_state";
  using Answer = ReloadState;
  Maybe<std::uint64_t> reload{};
};

// Returns the name of a received request. Throws RequestError.
std::string name_of(const nlohmann::json& request);

}  // namespace loopwarden::protocol
