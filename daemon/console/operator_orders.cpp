// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/operator_orders.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/clock.hpp"
#include "config/loop_model_writer.hpp"
#include "daemon/console/readings.hpp"
#include "daemon/console/request.hpp"
#include "daemon/console/status.hpp"
#include "daemon/loops/loop_orders.hpp"
#include "daemon/orders/order_text.hpp"

namespace loopwarden::daemon::console {

using base::LocalServer;
using nlohmann::json;

namespace {

// For how long who acts on alarms is left without an answer while the journal waits for the disk. Nobody else waits.
constexpr std::chrono::milliseconds kDiskPatience{1000};
constexpr std::chrono::milliseconds kLimitedDiskPatience{250};
constexpr std::chrono::milliseconds kRecordPatience{1000};

std::chrono::milliseconds patience_for(const Sender& sender) {
  return sender.socket == SocketName::control ? kDiskPatience : kLimitedDiskPatience;
}

// What `words` has for a word, or RequestError with `otherwise`.
template <class Meaning>
Meaning meant_by(const std::string& word, const std::map<std::string, Meaning>& words,
                 const char* otherwise) {
  const auto meaning = words.find(word);
  if (meaning == words.end()) throw RequestError(otherwise);
  return meaning->second;
}

control::Mode wanted_mode(const std::string& word) {
  static const std::map<std::string, control::Mode> kModes{{"auto", control::Mode::automatic},
                                                           {"automatic", control::Mode::automatic},
                                                           {"man", control::Mode::manual},
                                                           {"manual", control::Mode::manual}};
  return meant_by(word, kModes, "mode is auto or man");
}

rt::Expectation wanted_expectation(const protocol::Expected& expect) {
  rt::Expectation expected;
  if (expect.set_point) expected.set_point = *expect.set_point;
  if (expect.output) {
    expected.output = std::isnan(*expect.output) ? rt::kOutputNotKnown : *expect.output;
  }
  if (expect.mode) expected.mode = wanted_mode(*expect.mode);
  return expected;
}

// As one order, with what its sender has seen.
rt::Order wanted_order(const protocol::SetRequest& request) {
  static const std::map<std::string, rt::JacketWish> kJacket{
      {"off", rt::JacketWish::off}, {"shadow", rt::JacketWish::shadow}, {"on", rt::JacketWish::on}};
  rt::Order order;
  order.set_point = request.set_point;
  order.output = request.output;
  if (request.mode) order.mode = wanted_mode(*request.mode);
  if (request.jacket) {
    order.jacket = meant_by(*request.jacket, kJacket, "jacket is off, shadow or on");
  }
  if (request.expect) order.expected = wanted_expectation(*request.expect);
  return order;
}

alarm::AlarmAction wanted_action(const std::string& word) {
  static const std::map<std::string, alarm::AlarmAction> kActions{
      {"acknowledge", alarm::AlarmAction::acknowledge},
      {"reset", alarm::AlarmAction::reset},
      {"shelve", alarm::AlarmAction::shelve},
      {"unshelve", alarm::AlarmAction::unshelve}};
  return meant_by(word, kActions,
                  "action is acknowledge, reset, shelve or unshelve; of stiction calm, too");
}

std::int64_t wanted_shelf_ms(const protocol::AlarmRequest& request) {
  constexpr std::uint64_t kMostMinutes = 24UL * 60UL;
  const std::uint64_t minutes = request.minutes.value_or(0);
  if (minutes < 1 || minutes > kMostMinutes) {
    throw RequestError("minutes must be a whole number from 1 to 1440");
  }
  return static_cast<std::int64_t>(minutes) * 60'000;
}

}  // namespace

LocalServer::Answer OperatorOrders::answer(std::string_view what, const json& request,
                                           const Sender& sender) {
  if (what == protocol::SetRequest::kName) return done(set(request, sender));
  if (what == protocol::TuneRequest::kName) return done(tune(request, sender));
  if (what == protocol::CommissioningRequest::kName) {
    return done(commissioning(request, sender));
  }
  if (what == protocol::OrderRequest::kName) return done(order(request));
  if (what == protocol::RecordRequest::kName) return done(record(request, sender));
  if (what == protocol::AlarmRequest::kName) return alarm(request, sender);
  if (what == protocol::AcknowledgeIncidentRequest::kName) {
    return acknowledge_incident(request, sender);
  }
  if (what == protocol::AcknowledgeAllRequest::kName) return acknowledge_all(request, sender);
  if (what == protocol::ReloadStateRequest::kName) return done(reload_state(request));
  if (what == protocol::VetoRequest::kName) return veto(request, sender);
  if (what == protocol::OutcomeRequest::kName) return outcome(request, sender);
  if (what == protocol::NoteRequest::kName) return note(request, sender);
  if (what == protocol::ReportRequest::kName) return report(request, sender);
  // The files are read elsewhere: nobody waits for the disk here.
  const auto reload = request.get<protocol::ReloadRequest>();
  return done(protocol::ReloadNumber{parts_.reload(sender.peer, reload.dry_run.value_or(false),
                                                   reload.take_file.value_or(false))});
}

template <class Reply>
LocalServer::Answer OperatorOrders::when_written(Reply reply, std::uint64_t ticket,
                                                 const Sender& sender) const {
  using Clock = std::chrono::steady_clock;
  return [&journal = parts_.journal, reply = std::move(reply), ticket,
          until = Clock::now() + patience_for(sender)]() mutable -> std::optional<std::string> {
    const journal::Written written = journal.written(ticket);
    if (written == journal::Written::not_yet && Clock::now() < until) return std::nullopt;
    reply.on_disk = written == journal::Written::yes;
    return done(reply);
  };
}

orders::OrderDesk& OperatorOrders::desk(std::size_t loop) {
  // The loops come after the server.
  while (desks_.size() < parts_.loops.size()) {
    const std::size_t next = desks_.size();
    LoopRuntime& loop_of_it = parts_.loops[next];
    desks_.push_back(desk_of(
        loop_of_it, loop_of_it.channels->operator_orders, parts_.journal,
        [this, next](const rt::Order& order, const journal::JournalEntry& line) {
          // What the operator does with the jacket is not undone behind his back.
          if (!order.jacket || parts_.board.watch(next).corrective == alarm::CorrectiveState::off)
            return;
          parts_.board.set_veto(next, alarm::Veto::hands_off, line.peer, "jacket set by hand");
        }));
  }
  return desks_[loop];
}

void OperatorOrders::collect(Commissioning::Clock::time_point now) {
  for (orders::OrderDesk& desk : desks_) desk.collect();
  for (std::size_t loop = 0; loop < parts_.loops.size(); ++loop) {
    if (parts_.loops[loop].commissioning->silent(now)) {
      end_silent(loop, now);
    } else {
      endings_.erase(loop);
    }
  }
  end_records(now);
}

void OperatorOrders::write_down_commissioning(std::size_t loop, bool begun,
                                              const std::string& peer) {
  daemon::write_down_commissioning(parts_.loops[loop], begun, parts_.journal, parts_.board.now_ms(),
                                   peer);
}

// As at the daemon's end, but for the rate limit alone: the loop stays in manual there.
rt::Order OperatorOrders::stop_order(std::size_t loop) const {
  const rt::LoopSettings settings = parts_.loops[loop].settings->get();
  rt::Order order{.mode = control::Mode::manual, .ends_commissioning = true};
  if (settings.safety.on_stop.kind == control::OutputAction::Kind::value) {
    const control::OutputLimits& limits = settings.controller.output;
    order.output = std::clamp(settings.safety.on_stop.value, limits.low, limits.high);
  }
  return order;
}

void OperatorOrders::end_silent(std::size_t loop, Commissioning::Clock::time_point now) {
  constexpr const char* kPeer = "commissioning without a sign of life";
  constexpr std::chrono::seconds kBetweenTries{1};
  parts_.loops[loop].channels->withheld_until_ns = 0;
  Ending& ending = endings_[loop];
  if (ending.order) {
    const std::optional<orders::Outcome> outcome = desk(loop).outcome(*ending.order);
    if (!outcome) return;
    ending.order.reset();
    if (outcome->why.empty()) {
      endings_.erase(loop);
      return;
    }
  }
  if (now < ending.next) return;
  ending.next = now + kBetweenTries;
  rt::Order order = stop_order(loop);
  const std::string why = why_not(loop, order);
  if (!why.empty() && why == ending.refused) return;  // the journal has it
  ending.refused = why;
  try {
    ending.order = send(loop, order, lines_of(order, loop, kPeer), kPeer, "stop action").order;
  } catch (const RequestError&) {
    if (!order.output) return;
    // A fault's action has the output; the mode is taken all the same.
    order.output.reset();
    order.ends_commissioning = false;
    try {
      send(loop, order, lines_of(order, loop, kPeer), kPeer, "manual");
    } catch (const RequestError&) {  // both are in log and journal
    }
  }
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
    add("jacket", config::to_text(static_cast<control::JacketForm>(row.jacket_form)),
        kWishes[static_cast<std::size_t>(*order.jacket)]);
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

void OperatorOrders::refuse_watched(std::size_t loop) const {
  if (const std::string* why = config::out_of_service(parts_.loops[loop].config.io)) {
    throw RequestError(fmt::format("{} is out of service: {}", parts_.board.name(loop), *why));
  }
  if (!parts_.loops[loop].watched()) return;
  throw RequestError(parts_.board.name(loop) +
                     " is controlled elsewhere: nothing of it can be ordered from here");
}

// Nothing but the order itself has an effect here: what goes with it waits until the loop has taken
// it (desk()).
protocol::OrderTaken OperatorOrders::set(const protocol::SetRequest& request,
                                         const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  refuse_watched(index);
  LoopRuntime& loop = parts_.loops[index];
  rt::Order order = wanted_order(request);
  if (order.empty()) throw RequestError("set needs set_point, output, mode or jacket");
  orders::OrderDesk& orders = desk(index);
  const rt::InForce now = in_force(loop, orders);
  // Anybody takes the valve back: manual ends a commissioning. A machine may repeat the manual that
  // is in force.
  const bool may_repeat = sender.socket == SocketName::edge && order.mode == now.mode;
  order.ends_commissioning = !request.session && order.mode == control::Mode::manual &&
                             !order.set_point && !may_repeat &&
                             loop.commissioning->holder().has_value();
  // Parts that are in force already are no command. An order with at least one command is given
  // whole: it has the last word.
  rt::Order command = order;
  if (!request.expect) {  // otherwise the cycle's answer is of interest, and stands in the journal
    rt::leave_out_in_force(command, now, orders.standing(), loop.settings->get());
  }
  if (order.ends_commissioning) {
    command.mode = order.mode;
  } else {
    loop.commissioning->check_order(request.session, Commissioning::Clock::now());
    orders.for_each_waiting([&](const rt::Order& waiting) {
      if (waiting.ends_commissioning) {
        throw RequestError("the commissioning ends: somebody takes the loop back");
      }
    });
  }
  if (command.empty()) order = command;
  const bool refused = !why_not(index, order).empty();
  return send(index, order, lines_of(refused ? order : command, index, sender.peer), sender.peer,
              json(request).dump());
}

protocol::OrderTaken OperatorOrders::tune(const protocol::TuneRequest& request,
                                          const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  refuse_watched(index);
  LoopRuntime& loop = parts_.loops[index];
  loop.commissioning->check_order(std::nullopt, Commissioning::Clock::now());
  // As the loop's file is read; that each is a number of at least 0 the order's own rule says.
  if (request.kp == 0.0 && request.ki == 0.0) {
    throw RequestError("kp and ki are both 0: the output would never move");
  }
  rt::Order order{.kp = request.kp, .ki = request.ki, .kd = request.kd};
  if (request.expect) {
    order.expected.kp = request.expect->kp;
    order.expected.ki = request.expect->ki;
    order.expected.kd = request.expect->kd;
  }
  const rt::InForce now = in_force(loop, desk(index));
  if (!request.expect) {
    rt::leave_out_in_force(order, now, desk(index).standing(), loop.settings->get());
  }
  std::vector<journal::JournalEntry> lines;
  if (!order.empty()) {
    journal::JournalEntry& line = lines.emplace_back(line_of(index, sender.peer));
    line.what = "gains";
    line.old_value = orders::gains_text({now.kp, now.ki, now.kd});
    line.new_value = orders::gains_text({request.kp, request.ki, request.kd});
    const auto not_in_file = loop.settings->gains_not_in_file();
    const control::PidGains file =
        not_in_file ? not_in_file->file : loop.settings->get().controller.pid.gains;
    if (request.kp != file.kp || request.ki != file.ki || request.kd != file.kd) {
      line.reason = "not in file: a restart takes " + orders::gains_text(file);
    }
  }
  return send(index, order, std::move(lines), sender.peer, json(request).dump());
}

std::string OperatorOrders::why_not(std::size_t loop, const rt::Order& order) {
  const rt::LoopSettings settings = parts_.loops[loop].settings->get();
  orders::OrderDesk& desk = this->desk(loop);
  const rt::Refusal refusal =
      rt::judge(order, desk.standing(), settings, settings.controller.jacket.form);
  if (refusal != rt::Refusal::none) return orders::why_refused(refusal, order, settings);
  return desk.has_room() ? "" : "too many commands at once; nothing of this order was taken";
}

protocol::OrderTaken OperatorOrders::send(std::size_t loop, const rt::Order& order,
                                          std::vector<journal::JournalEntry> lines,
                                          const std::string& peer, const std::string& text) {
  const std::string why = why_not(loop, order);
  if (!lines.empty()) {  // else all of it is in force
    spdlog::info("loop {}: operator ({}) {}{}{}", parts_.board.name(loop), peer, text,
                 why.empty() ? "" : " refused: ", why);
  }
  if (!why.empty()) {
    for (journal::JournalEntry& line : lines) {
      line.result = "refused: " + why;
      parts_.journal.post(std::move(line));
    }
    throw RequestError(why);
  }
  return {.order = desk(loop).send(order, std::move(lines)),
          .sample_time_s = parts_.loops[loop].config.sample_time_s};
}

protocol::Commissioning OperatorOrders::commissioning(const protocol::CommissioningRequest& request,
                                                      const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  LoopRuntime& loop = parts_.loops[index];
  if (loop.watched()) {
    throw RequestError(request.loop + " is controlled elsewhere: it is never out of service here");
  }
  refuse_watched(index);
  const bool ends = request.end.value_or(false);
  if (ends && !request.session) throw RequestError("end needs the session");
  if (request.withhold_s && !ends) {
    const bool manual = desk(index).standing().mode == control::Mode::manual;
    if (const char* why = Commissioning::no_withholding(loop.config, *request.withhold_s, manual)) {
      throw RequestError(fmt::format("{}: {}", request.loop, why));
    }
  }
  const std::uint64_t session = loop.commissioning->take(
      request.session, sender.peer, parts_.board.now_ms(), Commissioning::Clock::now());
  if (ends) {
    loop.commissioning->give_back();
    write_down_commissioning(index, false, sender.peer);
    return {session};
  }
  if (!request.session) write_down_commissioning(index, true, sender.peer);
  if (request.withhold_s) {
    const auto for_ns = static_cast<std::int64_t>(*request.withhold_s * 1e9);
    loop.channels->withheld_until_ns = base::MonotonicClock().now_ns() + for_ns;
    journal::JournalEntry line = line_of(index, sender.peer);
    line.what = "commands withheld";
    line.new_value = fmt::format("{:g} s", *request.withhold_s);
    line.result = "done";
    parts_.journal.post(std::move(line));
  }
  return {session};
}

namespace {

// Of an order that held for another value only: the one in force, under its key in `set`.
std::optional<protocol::InForce> changed_value(const orders::Outcome& outcome) {
  switch (outcome.refusal) {
    case rt::Refusal::mode_changed:
      return protocol::InForce{.mode = outcome.now.mode == control::Mode::manual ? "manual"
                                                                                 : "automatic"};
    case rt::Refusal::set_point_changed:
      return protocol::InForce{.set_point = outcome.now.set_point};
    case rt::Refusal::output_changed: return protocol::InForce{.output = outcome.now.output};
    case rt::Refusal::gains_changed:
      return protocol::InForce{.gains =
                                   protocol::Gains{outcome.now.kp, outcome.now.ki, outcome.now.kd}};
    default: return std::nullopt;
  }
}

}  // namespace

protocol::OrderState OperatorOrders::order(const protocol::OrderRequest& request) {
  const std::size_t index = loop_index(parts_, request.loop);
  orders::OrderDesk& desk = this->desk(index);
  const std::uint64_t number = request.order.value_or(0);
  if (number < 1 || number > desk.newest()) throw RequestError("there is no such order");
  if (const std::optional<orders::Outcome> outcome = desk.outcome(number)) {
    const bool patient =
        std::chrono::steady_clock::now() - outcome->answered < kLimitedDiskPatience;
    if (outcome->why.empty() && patient && parts_.order_kept && !parts_.order_kept(index)) {
      return {.state = "waiting"};
    }
    return {.state = outcome->why.empty() ? "done" : "refused",
            .outcome =
                protocol::OrderOutcome{.why = outcome->why,
                                       .now = changed_value(*outcome),
                                       .on_disk = parts_.journal.wait_written(
                                           outcome->journal_ticket, std::chrono::milliseconds(0))}};
  }
  bool waits = false;
  desk.for_each_waiting([&](const rt::Order& one) { waits = waits || one.number == number; });
  if (!waits) throw RequestError("what became of that order is in the journal");
  return {.state = "waiting"};
}

protocol::RecordFile OperatorOrders::record(const protocol::RecordRequest& request,
                                            const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  Recorder& recorder = parts_.historian.recorder();
  const bool stop = request.stop.has_value();
  journal::JournalEntry line = line_of(index, sender.peer);
  line.what = stop ? "record stopped" : "record started";
  std::string file;
  try {
    constexpr double kLongest_s = 86'400.0;
    const double at_most_s = request.at_most_s.value_or(kLongest_s);
    if (!stop && !request.start) throw RequestError("a text is needed for \"start\"");
    if (!(at_most_s > 0.0 && at_most_s <= kLongest_s)) {
      throw RequestError("at_most_s must be above 0, at most 86400");
    }
    line.new_value = stop ? std::string() : *request.start;
    file = stop ? recorder.stop_csv(index, kRecordPatience)
                : recorder.start_csv(index, line.new_value, kRecordPatience);
    records_.erase(index);
    const auto session = parts_.loops[index].commissioning->session();
    if (!stop && (session || request.at_most_s)) {
      using Clock = Commissioning::Clock;
      const auto most =
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(at_most_s));
      records_[index] = {.file = file, .session = session, .until = Clock::now() + most};
    }
  } catch (const std::exception& e) {
    line.result = (stop ? "" : "refused: ") + std::string(e.what());
    parts_.journal.post(std::move(line));
    throw;
  }
  line.new_value = file;
  line.result = file.empty() ? "no record was being written" : "done";
  parts_.journal.post(std::move(line));
  return {file};
}

void OperatorOrders::end_records(Commissioning::Clock::time_point now) {
  Recorder& recorder = parts_.historian.recorder();
  for (auto at = records_.begin(); at != records_.end();) {
    const auto& [loop, record] = *at;
    const bool commissioned =
        !record.session || parts_.loops[loop].commissioning->session() == record.session;
    if (commissioned && now <= record.until) {
      ++at;
      continue;
    }
    if (recorder.status(loop).csv_file == record.file) {
      journal::JournalEntry line = line_of(loop, "loopwardend");
      line.what = "record stopped";
      line.new_value = record.file;
      line.reason = commissioned ? "its time is over" : "the commissioning has ended";
      line.result = "done";
      try {
        recorder.stop_csv(loop, std::chrono::milliseconds(0));
      } catch (const std::exception&) {  // it is completed later
      }
      parts_.journal.post(std::move(line));
    }
    at = records_.erase(at);
  }
}

LocalServer::Answer OperatorOrders::alarm(const protocol::AlarmRequest& request,
                                          const Sender& sender) {
  const bool calms = request.action == "calm" && request.alarm == "stiction";
  const alarm::AlarmAction action =
      calms ? alarm::AlarmAction::acknowledge : wanted_action(request.action);
  const std::int64_t shelve_ms =
      action == alarm::AlarmAction::shelve ? wanted_shelf_ms(request) : 0;
  std::string reason = short_text(request.reason, "reason");
  if (request.loop == alarm::kBox) {
    const alarm::BoxAlarm kind = wanted_box_alarm(request.alarm);
    const supervision::OrderResult result =
        parts_.box_alarms.act({kind, action, shelve_ms, sender.peer, std::move(reason)});
    if (!result.accepted) throw RequestError(result.why);
    return when_written(protocol::AlarmActed{.alarm = alarm_of(kind, parts_.box_alarms.alarms())},
                        result.ticket, sender);
  }
  const std::size_t index = loop_index(parts_, request.loop);
  if (calms) {
    parts_.loops[index].commissioning->check_order(std::nullopt, Commissioning::Clock::now());
  }
  const supervision::AlarmOrder order{wanted_alarm(request.alarm), action, shelve_ms, sender.peer,
                                      std::move(reason)};
  const supervision::OrderResult result =
      calms ? parts_.board.begin_offered(index, order.peer, order.reason)
            : parts_.board.act(index, order);
  if (!result.accepted) throw RequestError(result.why);
  const supervision::LoopWatch watch = parts_.board.watch(index);
  return when_written(protocol::AlarmActed{.alarm = alarm_of(request.loop, order.kind, watch)},
                      result.ticket, sender);
}

LocalServer::Answer OperatorOrders::acknowledge_incident(
    const protocol::AcknowledgeIncidentRequest& request, const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  const supervision::OrderResult result = parts_.board.acknowledge_incident(
      index, request.incident, sender.peer, short_text(request.reason, "reason"));
  if (!result.accepted) throw RequestError(result.why);
  protocol::IncidentActed acted;
  parts_.board.look(index, [&](const supervision::LoopWatch& watch) {
    acted.incident = incident_of(request.loop, watch).value();
  });
  return when_written(std::move(acted), result.ticket, sender);
}

LocalServer::Answer OperatorOrders::acknowledge_all(const protocol::AcknowledgeAllRequest& request,
                                                    const Sender& sender) {
  const supervision::Acknowledged done = parts_.board.acknowledge_all(
      alarm::kAlarmKinds, sender.peer, short_text(request.reason, "reason"));
  protocol::AllAcknowledged all;
  for (const auto& [loop, kind] : done.alarms) {
    all.acknowledged.push_back({parts_.board.name(loop), alarm::to_text(kind)});
  }
  const host::BoxAcknowledged of_box =
      parts_.box_alarms.acknowledge_all(sender.peer, short_text(request.reason, "reason"));
  for (const alarm::BoxAlarm kind : of_box.alarms) {
    all.acknowledged.push_back({alarm::kBox, alarm::to_text(kind)});
  }
  return when_written(std::move(all), std::max(done.ticket, of_box.ticket), sender);
}

LocalServer::Answer OperatorOrders::veto(const protocol::VetoRequest& request,
                                         const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  const supervision::OrderResult result =
      parts_.board.set_veto(index, request.veto ? alarm::Veto::back : alarm::Veto::none,
                            sender.peer, short_text(request.reason, "reason"));
  if (!result.accepted) throw RequestError(result.why);
  return when_written(protocol::Vetoed{}, result.ticket, sender);
}

LocalServer::Answer OperatorOrders::outcome(const protocol::OutcomeRequest& request,
                                            const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  if (std::find(protocol::kFoundWords.begin(), protocol::kFoundWords.end(), request.found) ==
      protocol::kFoundWords.end()) {
    throw RequestError(fmt::format("found is {}", fmt::join(protocol::kFoundWords, ", ")));
  }
  journal::JournalEntry line = line_of(index, sender.peer);
  line.what = "outcome";
  const supervision::LoopWatch watch = parts_.board.watch(index);
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::Alarm& alarm = watch.alarms.alarm(kind);
    if (!alarm.active() || alarm::is_process_alarm(kind)) continue;
    line.old_value += (line.old_value.empty() ? "" : ", ") + std::string(alarm::to_text(kind));
    if (alarm::has_size(kind))
      line.old_value += fmt::format(" {:.1f} %", alarm.memory().severity_percent);
  }
  if (line.old_value.empty()) line.old_value = "no alarm";
  line.new_value = request.found;
  line.reason = short_text(request.note, "note");
  line.result = "done";
  protocol::OutcomeKept kept{.said = line.old_value};
  return when_written(std::move(kept), parts_.journal.post(std::move(line)), sender);
}

LocalServer::Answer OperatorOrders::note(const protocol::NoteRequest& request,
                                         const Sender& sender) {
  journal::JournalEntry line = line_of(loop_index(parts_, request.loop), sender.peer);
  line.reason = short_text(request.text, "text");
  if (line.reason.empty()) throw RequestError("text: what is to be noted");
  const auto now_ms = static_cast<std::uint64_t>(line.utc_ms);
  const std::uint64_t about_ms = request.about_ms.value_or(now_ms);
  if (about_ms > now_ms) throw RequestError("about_ms: a time that has been");
  line.what = "note";
  line.new_value = fmt::format("{:%FT%TZ}", fmt::gmtime(static_cast<std::time_t>(about_ms / 1000)));
  line.result = "done";
  return when_written(protocol::Noted{}, parts_.journal.post(std::move(line)), sender);
}

void OperatorOrders::check_span(const protocol::ReportRequest& request, reports::Kind kind,
                                std::size_t loop) const {
  constexpr double kLeast_s = 60.0;  // of the loop's time
  // A gigabyte holds so many; a commissioning has several records of them at once.
  const double most_samples = kind == reports::Kind::commission ? 2e5 : 1e6;
  if (request.from_ms >= request.to_ms) throw RequestError("from_ms must be before to_ms");
  if (request.to_ms > static_cast<std::uint64_t>(parts_.board.now_ms())) {
    throw RequestError("to_ms: a time that has been");
  }
  const auto oldest_ms =
      static_cast<std::uint64_t>(parts_.historian.status(loop).segments.oldest_utc_ms);
  if (oldest_ms == 0) throw RequestError("nothing is recorded of " + request.loop);
  if (request.from_ms < oldest_ms) {
    throw RequestError(
        fmt::format("from_ms: what is recorded of {} begins at {:%FT%TZ} ({})", request.loop,
                    fmt::gmtime(static_cast<std::time_t>(oldest_ms / 1000)), oldest_ms));
  }
  const double sample_time_s = parts_.loops[loop].config.sample_time_s;
  const double span_s = static_cast<double>(request.to_ms - request.from_ms) / 1000.0 *
                        parts_.box_description().accelerate;
  if (span_s < kLeast_s) throw RequestError(fmt::format("at least {:g} s are needed", kLeast_s));
  if (span_s > most_samples * sample_time_s) {
    throw RequestError(fmt::format("{} takes at most {:.3g} h of {} ({:.0f} samples)", request.kind,
                                   most_samples * sample_time_s / 3600.0, request.loop,
                                   most_samples));
  }
}

LocalServer::Answer OperatorOrders::report(const protocol::ReportRequest& request,
                                           const Sender& sender) {
  const std::size_t index = loop_index(parts_, request.loop);
  const std::optional<reports::Kind> kind = reports::kind_of(request.kind);
  if (!kind) throw RequestError("kind is gap, commission, survey or diagnose");
  check_span(request, *kind, index);
  if (!parts_.reports.has_program()) {
    throw RequestError("loopwarden, which makes reports, is not installed beside the daemon");
  }
  const std::optional<reports::Report> taken =
      parts_.reports.post({.loop = request.loop,
                           .kind = *kind,
                           .from_ms = static_cast<std::int64_t>(request.from_ms),
                           .to_ms = static_cast<std::int64_t>(request.to_ms),
                           .by = sender.peer,
                           .twin = parts_.loops[index].config.monitor.twin});
  journal::JournalEntry line = line_of(index, sender.peer);
  line.what = "report";
  line.new_value = taken ? taken->name : request.kind;
  line.result = taken ? "asked for" : "refused: as many as may wait do";
  return when_written(
      protocol::ReportTaken{.taken = taken.has_value(),
                            .waiting = taken ? taken->place : parts_.reports.most_waiting(),
                            .name = taken ? taken->name : std::string()},
      parts_.journal.post(std::move(line)), sender);
}

protocol::ReloadState OperatorOrders::reload_state(const protocol::ReloadStateRequest& request) {
  std::optional<protocol::ReloadState> state = parts_.reload_state(request.reload.value_or(0));
  if (!state) throw RequestError("there is no such reload; the journal has the older ones");
  return std::move(*state);
}

}  // namespace loopwarden::daemon::console
