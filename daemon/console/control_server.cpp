// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/control_server.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "daemon/loops/loop_health.hpp"
#include "daemon/loops/loop_orders.hpp"
#include "daemon/console/metrics.hpp"
#include "daemon/orders/order_text.hpp"

namespace loopwarden::daemon {
namespace {

using nlohmann::json;
namespace model = loopwarden::monitor;

constexpr std::size_t kMostTrendRows = 512;
// For requests that need the disk. Other peers wait as long, once: behind a disk that hangs already
// nobody waits.
constexpr std::chrono::milliseconds kReaderPatience{1000};

// A request that can't be served; its text goes to the peer.
class RequestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

double wanted_number(const json& request, const char* key) {
  const json& value = request.at(key);
  if (!value.is_number()) throw RequestError(std::string(key) + " must be a number");
  return value.get<double>();
}

std::string wanted_text(const json& request, const char* key) {
  const auto it = request.find(key);
  if (it == request.end() || !it->is_string()) {
    throw RequestError(std::string("a text is needed for \"") + key + "\"");
  }
  return it->get<std::string>();
}

std::uint64_t optional_count(const json& request, const char* key, std::uint64_t fallback) {
  const auto it = request.find(key);
  if (it == request.end()) return fallback;
  if (!it->is_number_unsigned()) throw RequestError(std::string(key) + " must be a whole number");
  return it->get<std::uint64_t>();
}

const char* form_text(std::uint8_t form) {
  switch (static_cast<control::JacketForm>(form)) {
    case control::JacketForm::off: return "off";
    case control::JacketForm::paper: return "paper";
    case control::JacketForm::bounded: return "bounded";
    case control::JacketForm::dwell: break;
  }
  return "dwell";
}

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

// An operator's words; may be missing.
std::string reason_of(const json& request) {
  constexpr std::size_t kLongestText = 200;
  if (!request.contains("reason")) return {};
  std::string reason = wanted_text(request, "reason");
  if (reason.size() > kLongestText) throw RequestError("reason: at most 200 bytes");
  return reason;
}

model::AlarmKind wanted_alarm(const json& request) {
  const std::string name = wanted_text(request, "alarm");
  for (const model::AlarmKind kind : model::kAlarmKinds) {
    if (name == model::to_text(kind)) return kind;
  }
  throw RequestError("no alarm '" + name +
                     "'; alarms are stiction, backlash, hysteresis, low_air_supply, unknown, "
                     "model_gap");
}

model::AlarmAction wanted_action(const json& request) {
  static const std::map<std::string, model::AlarmAction> kActions{
      {"acknowledge", model::AlarmAction::acknowledge},
      {"reset", model::AlarmAction::reset},
      {"shelve", model::AlarmAction::shelve},
      {"unshelve", model::AlarmAction::unshelve}};
  const auto action = kActions.find(wanted_text(request, "action"));
  if (action == kActions.end()) {
    throw RequestError("action is acknowledge, reset, shelve or unshelve");
  }
  return action->second;
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
          {"consequence", alarm.explained() && alarm.active()},
          {"raised_ms", memory.raised_ms},
          {"changed_ms", memory.changed_ms},
          {"times_raised", memory.times_raised},
          {"shelved_until_ms", memory.shelved_until_ms},
          {"severity_percent", size(memory.severity_percent)},
          {"worst_severity_percent", size(memory.worst_severity_percent)}};
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

// Of this alarm, under its first or its final name.
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

}  // namespace

ControlServer::ControlServer(std::string socket_path, std::vector<LoopRuntime>& loops,
                             Historian& historian, monitor::WatchBoard& board,
                             journal::Journal& journal, const EvidenceStore& evidence,
                             double severe_percent, std::function<json()> daemon_status)
    : loops_(loops),
      historian_(historian),
      board_(board),
      journal_(journal),
      evidence_(evidence),
      severe_percent_(severe_percent),
      daemon_status_(std::move(daemon_status)),
      server_(std::move(socket_path),
              [this](std::string_view line, unsigned uid) { return answer(line, uid); }) {}

void ControlServer::start() {
  reader_.start();
  metrics_.start();
  thread_.start({.name = "lw-control"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) {
      try {
        server_.serve(std::chrono::milliseconds(200));
      } catch (const std::exception& e) {
        spdlog::error("control socket: {}", e.what());
      }
      collect_answers();
      publish_metrics();
      ticks_.fetch_add(1, std::memory_order_relaxed);
    }
  });
}

void ControlServer::publish_metrics() {
  constexpr std::chrono::seconds kInterval{5};
  if (metrics_file_.empty() || std::chrono::steady_clock::now() < metrics_due_) return;
  metrics_due_ = std::chrono::steady_clock::now() + kInterval;
  try {
    // A disk that refuses or hangs shows by the file's age.
    metrics_.begin(
        [file = metrics_file_, text = metrics_text(status())] { (void)write_metrics(file, text); });
  } catch (const std::exception& e) {
    spdlog::error("metrics: {}", e.what());
  }
}

void ControlServer::end_thread() noexcept {
  quit_ = true;
  thread_.join();
  try {
    for (orders::OrderDesk& desk : desks_) desk.close();
  } catch (const std::exception& e) {
    spdlog::error("orders: {}", e.what());
  }
}

void ControlServer::collect_answers() {
  try {
    for (orders::OrderDesk& desk : desks_) desk.collect();
  } catch (const std::exception& e) {
    spdlog::error("orders: {}", e.what());
  }
}

void ControlServer::stop() {
  end_thread();
  reader_.stop();
  metrics_.stop();
}

bool ControlServer::stop_for(std::chrono::milliseconds patience) {
  end_thread();
  const bool read = reader_.stop_for(patience);
  return metrics_.stop_for(patience) && read;
}

std::string ControlServer::answer(std::string_view line, unsigned peer_uid) {
  json reply;
  try {
    reply = handle(json::parse(line), peer_uid);
    reply["ok"] = true;
  } catch (const std::exception& e) {
    reply = {{"ok", false}, {"error", e.what()}};
  }
  return reply.dump(-1, ' ', false, json::error_handler_t::replace);
}

json ControlServer::handle(const json& request, unsigned peer_uid) {
  if (!request.is_object()) throw RequestError("a request is a JSON object");
  const std::string what = wanted_text(request, "request");
  if (what == "status") return status();
  if (what == "trend") return trend(request);
  if (what == "set") return set(request, peer_uid);
  if (what == "order") return order(request);
  if (what == "record") return record(request, peer_uid);
  if (what == "alarms") return alarms();
  if (what == "alarm") return alarm(request, peer_uid);
  if (what == "veto") return veto(request, peer_uid);
  if (what == "explain") return explain(request);
  if (what == "journal") return journal(request);
  throw RequestError("unknown request '" + what + "'");
}

std::size_t ControlServer::loop_index(const json& request) const {
  const std::string name = wanted_text(request, "loop");
  const auto it = std::find_if(loops_.begin(), loops_.end(),
                               [&](const LoopRuntime& loop) { return loop.config.name == name; });
  if (it == loops_.end()) throw RequestError("no loop '" + name + "'");
  return static_cast<std::size_t>(it - loops_.begin());
}

json ControlServer::status() const {
  json loops = json::array();
  for (std::size_t i = 0; i < loops_.size(); ++i) loops.push_back(loop_status(i));
  return {{"daemon", daemon_status_()}, {"loops", std::move(loops)}};
}

json ControlServer::loop_status(std::size_t index) const {
  const config::LoopConfig& config = loops_[index].config;
  const rt::LoopSettings settings = loops_[index].settings->get();
  json loop = {
      {"name", config.name},
      {"description", config.description},
      {"pv_unit", config.pv_unit},
      {"co_unit", config.co_unit},
      {"pv_range", {settings.pv_check.low, settings.pv_check.high}},
      {"co_range", {settings.controller.pid.output_low, settings.controller.pid.output_high}},
      {"sample_time_s", config.sample_time_s},
      {"io", io_status(loops_[index].io->counters())}};
  const RecordingStatus recording = historian_.status(index);
  loop["recording"] = {{"rows", recording.rows},
                       {"dropped", recording.dropped},
                       {"waiting", recording.waiting},
                       {"queue_dropped", recording.queue_dropped},
                       {"bytes", recording.segments.bytes},
                       {"rows_lost", recording.segments.rows_lost},
                       {"disk_errors", recording.segments.disk_errors},
                       {"last_disk_error", recording.segments.last_error},
                       {"csv_file", recording.csv_file},
                       {"csv_error", recording.csv_error}};
  const monitor::LoopWatch watch = board_.watch(index);
  loop["monitor"] = watch_json(watch);
  json alarm_states = json::object();
  for (const model::AlarmKind kind : model::kAlarmKinds) {
    alarm_states[model::to_text(kind)] = alarm_json(config.name, kind, watch.alarms.alarm(kind));
  }
  loop["alarms"] = std::move(alarm_states);
  loop["orders_refused"] = loops_[index].channels->orders_refused.load(std::memory_order_relaxed);
  const float position_age_ms =
      loops_[index].channels->position_age_ms.load(std::memory_order_relaxed);
  loop["position_age_ms"] =
      position_age_ms < 0.0F ? json(nullptr) : number(static_cast<double>(position_age_ms));
  record::RecordRow row;
  if (!historian_.latest(index, row)) return loop;
  loop["ne107"] = model::to_text(health_of(config, row, watch, severe_percent_));
  loop.update({{"time_s", static_cast<double>(row.period_index) * config.sample_time_s},
               {"period", row.period_index},
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
               {"at_low", (row.flags & record::kAtLow) != 0},
               {"at_high", (row.flags & record::kAtHigh) != 0},
               {"rate_limited", (row.flags & record::kRateLimited) != 0},
               {"output_lost", (row.flags & record::kOutputLost) != 0},
               {"jacket",
                {{"form", form_text(row.jacket_form)},
                 {"acting", (row.flags & record::kJacketActs) != 0},
                 {"rate", number(static_cast<double>(row.jacket_rate))},
                 {"shadow_rate", number(static_cast<double>(row.jacket_rate_shadow))}}},
               {"compensator",
                {{"kind", control::to_text(settings.controller.compensator.kind)},
                 {"acting", (row.flags & record::kCompensatorActs) != 0},
                 {"added", number(static_cast<double>(row.compensator))},
                 {"shadow_added", number(static_cast<double>(row.compensator_shadow))}}}});
  return loop;
}

json ControlServer::trend(const json& request) const {
  const std::size_t index = loop_index(request);
  const std::uint64_t most =
      std::min<std::uint64_t>(optional_count(request, "most", kMostTrendRows), kMostTrendRows);
  const auto rows = historian_.rows(index, optional_count(request, "from", 0), most);
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
  json reply = {{"sample_time_s", loops_[index].config.sample_time_s},
                {"period", std::move(period)}};
  for (auto& [name, values] : columns) reply[name] = std::move(values);
  return reply;
}

orders::OrderDesk& ControlServer::desk(std::size_t loop) {
  // The loops come after the server.
  while (desks_.size() < loops_.size()) {
    LoopRuntime& next = loops_[desks_.size()];
    desks_.push_back(desk_of(next, next.channels->operator_orders, journal_));
  }
  return desks_[loop];
}

journal::JournalEntry ControlServer::line_of(std::size_t loop, unsigned peer_uid) const {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = board_.now_ms();
  line.loop = board_.name(loop);
  line.peer = fmt::format("uid {}", peer_uid);
  return line;
}

std::vector<journal::JournalEntry> ControlServer::lines_of(const rt::Order& order, std::size_t loop,
                                                           unsigned peer_uid) const {
  const rt::LoopChannels& channels = *loops_[loop].channels;
  record::RecordRow row;
  const bool known = historian_.latest(loop, row);
  std::vector<journal::JournalEntry> lines;
  const auto add = [&](const char* what, const std::string& before, const std::string& after) {
    journal::JournalEntry& line = lines.emplace_back(line_of(loop, peer_uid));
    line.what = what;
    if (known) line.old_value = before;
    line.new_value = after;
  };
  const auto text = [](double value) { return fmt::format("{:.9g}", value); };
  if (order.jacket) {
    constexpr std::array kWishes{"off", "shadow", "on"};
    add("jacket", form_text(row.jacket_form), kWishes[static_cast<std::size_t>(*order.jacket)]);
  }
  if (order.mode) {
    add("mode", control::to_text(static_cast<control::Mode>(row.requested_mode)),
        control::to_text(*order.mode));
  }
  if (order.set_point) {
    add("set point", text(channels.set_point_wanted.load(std::memory_order_relaxed)),
        text(*order.set_point));
  }
  if (order.output) add("output", text(row.co), text(*order.output));
  return lines;
}

json ControlServer::set(const json& request, unsigned peer_uid) {
  const std::size_t index = loop_index(request);
  LoopRuntime& loop = loops_[index];
  const rt::LoopSettings settings = loop.settings->get();
  rt::Order order;
  if (request.contains("set_point")) order.set_point = wanted_number(request, "set_point");
  if (request.contains("output")) order.output = wanted_number(request, "output");
  if (request.contains("mode")) {
    static const std::map<std::string, control::Mode> kModes{
        {"auto", control::Mode::automatic},
        {"automatic", control::Mode::automatic},
        {"man", control::Mode::manual},
        {"manual", control::Mode::manual}};
    const auto mode = kModes.find(wanted_text(request, "mode"));
    if (mode == kModes.end()) throw RequestError("mode is auto or man");
    order.mode = mode->second;
  }
  if (request.contains("jacket")) {
    static const std::map<std::string, rt::JacketWish> kJacket{{"off", rt::JacketWish::off},
                                                               {"shadow", rt::JacketWish::shadow},
                                                               {"on", rt::JacketWish::on}};
    const auto wish = kJacket.find(wanted_text(request, "jacket"));
    if (wish == kJacket.end()) throw RequestError("jacket is off, shadow or on");
    order.jacket = wish->second;
  }
  std::vector<journal::JournalEntry> lines = lines_of(order, index, peer_uid);
  if (lines.empty()) throw RequestError("set needs set_point, output, mode or jacket");
  orders::OrderDesk& desk = this->desk(index);
  const rt::Refusal refusal =
      rt::judge(order, desk.standing(), settings, settings.controller.jacket.form);
  std::string why;
  if (refusal != rt::Refusal::none) {
    why = orders::why_refused(refusal, order, settings);
  } else if (!desk.has_room()) {
    why = "too many commands at once; nothing of this order was taken";
  }
  spdlog::info("loop {}: operator (uid {}) {}{}{}", loop.config.name, peer_uid, request.dump(),
               why.empty() ? "" : " refused: ", why);
  if (!why.empty()) {
    for (journal::JournalEntry& line : lines) {
      line.result = "refused: " + why;
      journal_.post(std::move(line));
    }
    throw RequestError(why);
  }
  const std::uint64_t number = desk.send(order, std::move(lines));
  // What the operator does with the jacket is not undone behind his back.
  if (order.jacket && board_.watch(index).corrective != model::CorrectiveState::off) {
    board_.set_veto(index, model::Veto::hands_off, fmt::format("uid {}", peer_uid),
                    "jacket set by hand", std::chrono::milliseconds(0));
  }
  return {{"order", number}, {"sample_time_s", loop.config.sample_time_s}};
}

json ControlServer::order(const json& request) {
  orders::OrderDesk& desk = this->desk(loop_index(request));
  const std::uint64_t number = optional_count(request, "order", 0);
  if (number < 1 || number > desk.newest()) throw RequestError("there is no such order");
  if (const std::optional<orders::Outcome> outcome = desk.outcome(number)) {
    return {
        {"state", outcome->why.empty() ? "done" : "refused"},
        {"why", outcome->why},
        {"on_disk", journal_.wait_written(outcome->journal_ticket, std::chrono::milliseconds(0))}};
  }
  bool waits = false;
  desk.for_each_waiting([&](const rt::Order& one) { waits = waits || one.number == number; });
  if (!waits) throw RequestError("what became of that order is in the journal");
  return {{"state", "waiting"}};
}

json ControlServer::record(const json& request, unsigned peer_uid) {
  const std::size_t index = loop_index(request);
  Recorder& recorder = historian_.recorder();
  const bool stop = request.contains("stop");
  journal::JournalEntry line = line_of(index, peer_uid);
  line.what = stop ? "record stopped" : "record started";
  std::string file;
  try {
    line.new_value = stop ? std::string() : wanted_text(request, "start");
    file = stop ? recorder.stop_csv(index, kReaderPatience)
                : recorder.start_csv(index, line.new_value, kReaderPatience);
  } catch (const std::exception& e) {
    line.result = (stop ? "" : "refused: ") + std::string(e.what());
    journal_.post(std::move(line));
    throw;
  }
  line.new_value = file;
  line.result = file.empty() ? "no record was being written" : "done";
  journal_.post(std::move(line));
  return {{"file", file}};
}

json ControlServer::alarms() const {
  json all = json::array();
  for (std::size_t i = 0; i < board_.loops(); ++i) {
    const monitor::LoopWatch watch = board_.watch(i);
    for (const model::AlarmKind kind : model::kAlarmKinds) {
      all.push_back(alarm_json(board_.name(i), kind, watch.alarms.alarm(kind)));
    }
  }
  return {{"now_ms", board_.now_ms()}, {"alarms", std::move(all)}};
}

json ControlServer::alarm(const json& request, unsigned peer_uid) {
  constexpr std::uint64_t kMostMinutes = 24UL * 60UL;
  const std::size_t index = loop_index(request);
  monitor::AlarmOrder order;
  order.kind = wanted_alarm(request);
  order.action = wanted_action(request);
  order.peer = fmt::format("uid {}", peer_uid);
  order.reason = reason_of(request);
  if (order.action == model::AlarmAction::shelve) {
    const std::uint64_t minutes = optional_count(request, "minutes", 0);
    if (minutes < 1 || minutes > kMostMinutes) {
      throw RequestError("minutes must be a whole number from 1 to 1440");
    }
    order.shelve_ms = static_cast<std::int64_t>(minutes) * 60'000;
  }
  const monitor::OrderResult result = board_.act(index, order);
  if (!result.accepted) throw RequestError(result.why);
  const monitor::LoopWatch watch = board_.watch(index);
  return {{"alarm", alarm_json(board_.name(index), order.kind, watch.alarms.alarm(order.kind))},
          {"on_disk", result.on_disk}};
}

json ControlServer::veto(const json& request, unsigned peer_uid) {
  const std::size_t index = loop_index(request);
  const auto wanted = request.find("veto");
  if (wanted == request.end() || !wanted->is_boolean()) {
    throw RequestError("veto must be true or false");
  }
  const monitor::OrderResult result =
      board_.set_veto(index, wanted->get<bool>() ? model::Veto::back : model::Veto::none,
                      fmt::format("uid {}", peer_uid), reason_of(request));
  if (!result.accepted) throw RequestError(result.why);
  return {{"on_disk", result.on_disk}};
}

json ControlServer::explain(const json& request) {
  constexpr std::size_t kMostLines = 200;
  const std::size_t index = loop_index(request);
  const model::AlarmKind kind = wanted_alarm(request);
  const monitor::LoopWatch watch = board_.watch(index);
  const model::AlarmGuide guide = model::guide_of(kind);
  struct OnDisk {
    std::optional<std::filesystem::path> folder;
    std::vector<journal::JournalRow> rows;
  };
  const std::string name = board_.name(index);
  const std::optional<OnDisk> disk = reader_.ask<OnDisk>(
      [this, name, kind] {
        return OnDisk{evidence_.newest(name, kind), journal_.newest(kMostLines, name)};
      },
      kReaderPatience);
  const auto folder = disk ? disk->folder : std::nullopt;
  json history = json::array();
  for (const journal::JournalRow& row : disk ? disk->rows : std::vector<journal::JournalRow>()) {
    if (row.entry.alarm == model::to_text(kind)) history.push_back(journal_json(row));
  }
  return {{"alarm", alarm_json(board_.name(index), kind, watch.alarms.alarm(kind))},
          {"cause", guide.cause},
          {"consequence", guide.consequence},
          {"action", guide.action},
          {"explanation", explanation_of(watch, kind)},
          {"monitor", watch_json(watch)},
          {"disk_answers", disk.has_value()},
          {"evidence", folder ? json(folder->string()) : json(nullptr)},
          {"history", std::move(history)}};
}

json ControlServer::journal(const json& request) {
  constexpr std::uint64_t kMostLines = 200;
  const std::uint64_t most = std::min(optional_count(request, "most", 50), kMostLines);
  const std::string loop =
      request.contains("loop") ? board_.name(loop_index(request)) : std::string();
  const auto rows = reader_.ask<std::vector<journal::JournalRow>>(
      [this, most, loop] { return journal_.newest(most, loop); }, kReaderPatience);
  if (!rows) throw RequestError("the disk does not answer; the journal can't be read");
  json lines = json::array();
  for (const journal::JournalRow& row : *rows) {
    lines.push_back(journal_json(row));
  }
  return {{"lines", std::move(lines)}};
}

}  // namespace loopwarden::daemon
