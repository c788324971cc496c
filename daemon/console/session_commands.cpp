// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/session_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "base/clock.hpp"
#include "daemon/console/journal_answer.hpp"
#include "daemon/loops/loop_queue.hpp"

namespace loopwarden::daemon::console {

protocol::Commissioning SessionCommands::commissioning(
    const protocol::CommissioningRequest& request, const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  LoopRuntime& loop = plant_.loops[index];
  if (loop.watched()) {
    throw RequestError(request.loop + " is controlled elsewhere: it is never out of service here");
  }
  check_takes_commands(plant_, index);
  const bool ends = request.end.value_or(false);
  if (ends && !request.session) throw RequestError("end needs the session");
  const bool of_test = request.session ? tests_.runs_on(index) : request.test.has_value();
  if (sender.socket != SocketName::control && !of_test) {
    throw RequestError("commissioning is on control.sock alone, except for a test");
  }
  if (request.test && !request.session)
    return {tests_.begin(index, *request.test, sender, clock_())};
  if (request.session && tests_.runs_on(index)) return in_test(request, index);
  if (request.move) throw RequestError("move needs the session of a test");
  if (request.withhold_s && !ends) check_withholding(request, index);
  const std::uint64_t session =
      loop.commissioning->take(request.session, sender.peer, plant_.alarms.now_ms(), clock_());
  if (ends) {
    loop.commissioning->give_back();
    write_down(index, false, sender.peer);
    return {session};
  }
  if (!request.session) write_down(index, true, sender.peer);
  if (request.withhold_s) withhold(index, *request.withhold_s, sender.peer);
  return {session};
}

// Moves or ends the loop's test, or shows a sign of life.
protocol::Commissioning SessionCommands::in_test(const protocol::CommissioningRequest& request,
                                                 std::size_t loop) {
  const std::uint64_t session =
      plant_.loops[loop].commissioning->take(request.session, {}, plant_.alarms.now_ms(), clock_());
  if (request.end.value_or(false)) {
    const std::string why = short_text(request.why, "why");
    tests_.end(loop, why.empty() ? "as planned" : why);
  } else if (request.move) {
    tests_.move(loop, *request.move);
  }
  return {session};
}

base::LocalServer::Answer SessionCommands::test_result(const protocol::TestResultRequest& request,
                                                       const Sender& sender) {
  journal::JournalEntry line = operator_line(plant_, loop_index(plant_, request.loop), sender.peer);
  journal::set_test_result(line, short_text(request.explanations, "explanations"),
                           request.predicted, short_text(request.decided, "decided"),
                           request.probability);
  return when_written(journal_, protocol::Noted{}, journal_.post(std::move(line)), sender);
}

void SessionCommands::check_withholding(const protocol::CommissioningRequest& request,
                                        std::size_t loop) {
  const bool manual = commands_.queue(loop).availability().mode == control::Mode::manual;
  if (const char* why =
          Commissioning::no_withholding(plant_.loops[loop].config, *request.withhold_s, manual)) {
    throw RequestError(fmt::format("{}: {}", request.loop, why));
  }
}

void SessionCommands::withhold(std::size_t loop, double seconds, const std::string& peer) {
  const auto for_ns = static_cast<std::int64_t>(seconds * 1e9);
  plant_.loops[loop].channels->withheld_until_ns = base::MonotonicClock().now_ns() + for_ns;
  journal::JournalEntry line = operator_line(plant_, loop, peer);
  line.what = "commands withheld";
  line.new_value = fmt::format("{:g} s", seconds);
  line.result = "done";
  journal_.post(std::move(line));
}

void SessionCommands::end_sessions(Commissioning::Clock::time_point now) {
  tests_.tick(now);
  for (std::size_t loop = 0; loop < plant_.loops.size(); ++loop) {
    if (tests_.runs_on(loop)) continue;
    if (plant_.loops[loop].commissioning->silent(now)) {
      end_silent(loop, now);
    } else {
      endings_.erase(loop);
    }
  }
}

void SessionCommands::end_silent(std::size_t loop, Commissioning::Clock::time_point now) {
  constexpr const char* kPeer = "commissioning without a sign of life";
  constexpr std::chrono::seconds kBetweenTries{1};
  plant_.loops[loop].channels->withheld_until_ns = 0;
  Ending& ending = endings_[loop];
  if (ending.command) {
    const std::optional<commands::Outcome> outcome = commands_.queue(loop).outcome(*ending.command);
    if (!outcome) return;
    ending.command.reset();
    if (outcome->why.empty()) {
      endings_.erase(loop);
      return;
    }
  }
  if (now < ending.next) return;
  ending.next = now + kBetweenTries;
  rt::Command command = stop_command(loop);
  const std::string why = commands_.refusal_of(loop, command);
  if (!why.empty() && why == ending.refused) return;  // the journal has it
  ending.refused = why;
  try {
    ending.command = commands_.send(loop, command, kPeer, "stop action").order;
  } catch (const RequestError&) {
    if (!command.output) return;
    // The action of a fault has the output. The loop accepts manual nevertheless.
    command.output.reset();
    command.ends_commissioning = false;
    try {
      commands_.send(loop, command, kPeer, "manual");
    } catch (const RequestError&) {  // both refusals are in log and journal
    }
  }
}

// The stop action as at the end of the daemon, but with the normal rate limit: the loop stays in
// manual at this output.
rt::Command SessionCommands::stop_command(std::size_t loop) const {
  const rt::LoopSettings settings = plant_.loops[loop].settings->get();
  rt::Command command{.mode = control::Mode::manual, .ends_commissioning = true};
  if (settings.safety.on_stop.kind == control::OutputAction::Kind::value) {
    const control::OutputLimits& limits = settings.controller.output;
    command.output = std::clamp(settings.safety.on_stop.value, limits.low, limits.high);
  }
  return command;
}

void SessionCommands::write_down(std::size_t loop, bool begun, const std::string& peer) {
  write_down_commissioning(plant_.loops[loop], begun, journal_, plant_.alarms.now_ms(), peer);
}

}  // namespace loopwarden::daemon::console
