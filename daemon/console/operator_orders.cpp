// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/operator_orders.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "daemon/console/readings.hpp"
#include "daemon/console/request.hpp"
#include "daemon/console/status_json.hpp"
#include "daemon/loops/loop_orders.hpp"
#include "daemon/orders/order_text.hpp"

namespace loopwarden::daemon::console {

using base::LocalServer;
using nlohmann::json;
namespace model = loopwarden::monitor;

namespace {

// For how long who acts on alarms is left without an answer while the journal waits for the disk. Nobody else waits.
constexpr std::chrono::milliseconds kDiskPatience{1000};
constexpr std::chrono::milliseconds kLimitedDiskPatience{250};
constexpr std::chrono::milliseconds kRecordPatience{1000};

std::chrono::milliseconds patience_for(const Sender& sender) {
  return sender.socket == SocketName::control ? kDiskPatience : kLimitedDiskPatience;
}

control::Mode wanted_mode(const json& request) {
  static const std::map<std::string, control::Mode> kModes{{"auto", control::Mode::automatic},
                                                           {"automatic", control::Mode::automatic},
                                                           {"man", control::Mode::manual},
                                                           {"manual", control::Mode::manual}};
  const auto mode = kModes.find(wanted_text(request, "mode"));
  if (mode == kModes.end()) throw RequestError("mode is auto or man");
  return mode->second;
}

rt::Expectation wanted_expectation(const json& expect) {
  if (!expect.is_object()) throw RequestError("expect is an object");
  rt::Expectation expected;
  for (const auto& [key, value] : expect.items()) {
    if (key == "set_point") {
      expected.set_point = wanted_number(expect, "set_point");
    } else if (key == "output") {
      expected.output = value.is_null() ? rt::kOutputNotKnown : wanted_number(expect, "output");
    } else if (key == "mode") {
      expected.mode = wanted_mode(expect);
    } else {
      // What is not looked at must not seem to be.
      throw RequestError("expect has set_point, output and mode, not '" + key + "'");
    }
  }
  return expected;
}

// As one order, with what its sender has seen.
rt::Order wanted_order(const json& request) {
  rt::Order order;
  if (request.contains("set_point")) order.set_point = wanted_number(request, "set_point");
  if (request.contains("output")) order.output = wanted_number(request, "output");
  if (request.contains("mode")) order.mode = wanted_mode(request);
  if (request.contains("jacket")) {
    static const std::map<std::string, rt::JacketWish> kJacket{{"off", rt::JacketWish::off},
                                                               {"shadow", rt::JacketWish::shadow},
                                                               {"on", rt::JacketWish::on}};
    const auto wish = kJacket.find(wanted_text(request, "jacket"));
    if (wish == kJacket.end()) throw RequestError("jacket is off, shadow or on");
    order.jacket = wish->second;
  }
  if (request.contains("expect")) order.expected = wanted_expectation(request.at("expect"));
  return order;
}

// An operator's words; may be missing.
std::string reason_of(const json& request) { return optional_text(request, "reason", 200); }

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

}  // namespace

LocalServer::Answer OperatorOrders::answer(std::string_view what, const json& request,
                                           const Sender& sender) {
  if (what == "set") return done(set(request, sender));
  if (what == "order") return done(order(request));
  if (what == "record") return done(record(request, sender));
  if (what == "alarm") return alarm(request, sender);
  if (what == "acknowledge_all") return acknowledge_all(request, sender);
  if (what == "reload") return done(reload(request, sender));
  if (what == "reload_state") return done(reload_state(request));
  return veto(request, sender);
}

LocalServer::Answer OperatorOrders::when_written(json reply, std::uint64_t ticket,
                                                 const Sender& sender) const {
  using Clock = std::chrono::steady_clock;
  return [&journal = parts_.journal, reply = std::move(reply), ticket,
          until = Clock::now() + patience_for(sender)]() mutable -> std::optional<std::string> {
    const journal::Written written = journal.written(ticket);
    if (written == journal::Written::not_yet && Clock::now() < until) return std::nullopt;
    reply["on_disk"] = written == journal::Written::yes;
    return done(std::move(reply));
  };
}

orders::OrderDesk& OperatorOrders::desk(std::size_t loop) {
  // The loops come after the server.
  while (desks_.size() < parts_.loops.size()) {
    LoopRuntime& next = parts_.loops[desks_.size()];
    desks_.push_back(desk_of(next, next.channels->operator_orders, parts_.journal));
  }
  return desks_[loop];
}

void OperatorOrders::collect() {
  for (orders::OrderDesk& desk : desks_) desk.collect();
}

void OperatorOrders::close() {
  for (orders::OrderDesk& desk : desks_) desk.close();
}

journal::JournalEntry OperatorOrders::line_of(std::size_t loop, const std::string& peer) const {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = parts_.board.now_ms();
  line.loop = parts_.board.name(loop);
  line.peer = peer;
  return line;
}

std::vector<journal::JournalEntry> OperatorOrders::lines_of(const rt::Order& order,
                                                            std::size_t loop,
                                                            const std::string& peer) const {
  const rt::LoopChannels& channels = *parts_.loops[loop].channels;
  record::RecordRow row;
  const bool known = parts_.historian.latest(loop, row);
  std::vector<journal::JournalEntry> lines;
  const auto add = [&](const char* what, const std::string& before, const std::string& after) {
    journal::JournalEntry& line = lines.emplace_back(line_of(loop, peer));
    line.what = what;
    if (known) line.old_value = before;
    line.new_value = after;
  };
  const auto text = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.9g}", value) : std::string();
  };
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

json OperatorOrders::set(const json& request, const Sender& sender) {
  const std::size_t index = loop_index(parts_, request);
  const rt::LoopSettings settings = parts_.loops[index].settings->get();
  const rt::Order order = wanted_order(request);
  std::vector<journal::JournalEntry> lines = lines_of(order, index, sender.peer);
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
  spdlog::info("loop {}: operator ({}) {}{}{}", parts_.board.name(index), sender.peer,
               request.dump(), why.empty() ? "" : " refused: ", why);
  if (!why.empty()) {
    for (journal::JournalEntry& line : lines) {
      line.result = "refused: " + why;
      parts_.journal.post(std::move(line));
    }
    throw RequestError(why);
  }
  const std::uint64_t number = desk.send(order, std::move(lines));
  // What the operator does with the jacket is not undone behind his back.
  if (order.jacket && parts_.board.watch(index).corrective != model::CorrectiveState::off) {
    parts_.board.set_veto(index, model::Veto::hands_off, sender.peer, "jacket set by hand");
  }
  return {{"order", number}, {"sample_time_s", parts_.loops[index].config.sample_time_s}};
}

namespace {

// Of an order that held for another value only: the one in force, under its key in `set`.
json changed_value(const orders::Outcome& outcome) {
  switch (outcome.refusal) {
    case rt::Refusal::mode_changed:
      return {{"mode", outcome.now.mode == control::Mode::manual ? "manual" : "automatic"}};
    case rt::Refusal::set_point_changed: return {{"set_point", number(outcome.now.set_point)}};
    case rt::Refusal::output_changed: return {{"output", number(outcome.now.output)}};
    default: return nullptr;
  }
}

}  // namespace

json OperatorOrders::order(const json& request) {
  orders::OrderDesk& desk = this->desk(loop_index(parts_, request));
  const std::uint64_t number = optional_count(request, "order", 0);
  if (number < 1 || number > desk.newest()) throw RequestError("there is no such order");
  if (const std::optional<orders::Outcome> outcome = desk.outcome(number)) {
    return {{"state", outcome->why.empty() ? "done" : "refused"},
            {"why", outcome->why},
            {"now", changed_value(*outcome)},
            {"on_disk",
             parts_.journal.wait_written(outcome->journal_ticket, std::chrono::milliseconds(0))}};
  }
  bool waits = false;
  desk.for_each_waiting([&](const rt::Order& one) { waits = waits || one.number == number; });
  if (!waits) throw RequestError("what became of that order is in the journal");
  return {{"state", "waiting"}};
}

json OperatorOrders::record(const json& request, const Sender& sender) {
  const std::size_t index = loop_index(parts_, request);
  Recorder& recorder = parts_.historian.recorder();
  const bool stop = request.contains("stop");
  journal::JournalEntry line = line_of(index, sender.peer);
  line.what = stop ? "record stopped" : "record started";
  std::string file;
  try {
    line.new_value = stop ? std::string() : wanted_text(request, "start");
    file = stop ? recorder.stop_csv(index, kRecordPatience)
                : recorder.start_csv(index, line.new_value, kRecordPatience);
  } catch (const std::exception& e) {
    line.result = (stop ? "" : "refused: ") + std::string(e.what());
    parts_.journal.post(std::move(line));
    throw;
  }
  line.new_value = file;
  line.result = file.empty() ? "no record was being written" : "done";
  parts_.journal.post(std::move(line));
  return {{"file", file}};
}

LocalServer::Answer OperatorOrders::alarm(const json& request, const Sender& sender) {
  constexpr std::uint64_t kMostMinutes = 24UL * 60UL;
  const std::size_t index = loop_index(parts_, request);
  monitor::AlarmOrder order;
  order.kind = wanted_alarm(request);
  order.action = wanted_action(request);
  order.peer = sender.peer;
  order.reason = reason_of(request);
  if (order.action == model::AlarmAction::shelve) {
    const std::uint64_t minutes = optional_count(request, "minutes", 0);
    if (minutes < 1 || minutes > kMostMinutes) {
      throw RequestError("minutes must be a whole number from 1 to 1440");
    }
    order.shelve_ms = static_cast<std::int64_t>(minutes) * 60'000;
  }
  const monitor::OrderResult result = parts_.board.act(index, order);
  if (!result.accepted) throw RequestError(result.why);
  const monitor::LoopWatch watch = parts_.board.watch(index);
  return when_written(
      {{"alarm", alarm_json(parts_.board.name(index), order.kind, watch.alarms.alarm(order.kind))}},
      result.ticket, sender);
}

LocalServer::Answer OperatorOrders::acknowledge_all(const json& request, const Sender& sender) {
  const monitor::Acknowledged done =
      parts_.board.acknowledge_all(model::kAlarmKinds, sender.peer, reason_of(request));
  json alarms = json::array();
  for (const auto& [loop, kind] : done.alarms) {
    alarms.push_back({{"loop", parts_.board.name(loop)}, {"alarm", model::to_text(kind)}});
  }
  return when_written({{"acknowledged", std::move(alarms)}}, done.ticket, sender);
}

LocalServer::Answer OperatorOrders::veto(const json& request, const Sender& sender) {
  const std::size_t index = loop_index(parts_, request);
  const auto wanted = request.find("veto");
  if (wanted == request.end() || !wanted->is_boolean()) {
    throw RequestError("veto must be true or false");
  }
  const monitor::OrderResult result =
      parts_.board.set_veto(index, wanted->get<bool>() ? model::Veto::back : model::Veto::none,
                            sender.peer, reason_of(request));
  if (!result.accepted) throw RequestError(result.why);
  return when_written(json::object(), result.ticket, sender);
}

// The files are read elsewhere: nobody waits for the disk here.
json OperatorOrders::reload(const json& request, const Sender& sender) {
  return {{"reload", parts_.reload(sender.peer, optional_flag(request, "dry_run"))}};
}

json OperatorOrders::reload_state(const json& request) {
  json state = parts_.reload_state(optional_count(request, "reload", 0));
  if (state.is_null())
    throw RequestError("there is no such reload; the journal has the older ones");
  return state;
}

}  // namespace loopwarden::daemon::console
