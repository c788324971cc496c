// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/test_sessions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "daemon/console/journal_answer.hpp"
#include "daemon/loops/loop_queue.hpp"

namespace loopwarden::daemon::console {
namespace {

using control::Mode;
using protocol::Range;

constexpr const char* kPeer = "end of the test";
constexpr std::chrono::seconds kBetweenTries{1};
constexpr std::chrono::seconds kOutputReturns{30};
constexpr double kReturned = 0.002;  // of the CO span

bool inside(double value, const Range& range) noexcept {
  return value >= range[0] && value <= range[1];
}

std::string outside(const char* what, double value, const Range& range) {
  if (!std::isfinite(value)) return fmt::format("{} is not known", what);
  return fmt::format("{} {:.4g} is outside of {:.6g} to {:.6g}", what, value, range[0], range[1]);
}

bool is_within(const Range& range, double low, double high) noexcept {
  return range[0] < range[1] && range[0] >= low && range[1] <= high;
}

}  // namespace

std::uint64_t TestSessions::begin(std::size_t loop, const protocol::TestTerms& terms,
                                  const Sender& sender, Clock::time_point at) {
  for (std::size_t i = 0; i < plant_.loops.size(); ++i) {
    if (const auto holder = plant_.loops[i].commissioning->holder()) {
      throw RequestError(fmt::format("{} is in maintenance by {}: a test needs the box for itself",
                                     plant_.alarms.name(i), holder->by));
    }
  }
  LoopRuntime& runtime = plant_.loops[loop];
  commands::CommandQueue& queue = commands_.queue(loop);
  record::RecordRow row;
  if (queue.waiting() || !plant_.historian.latest(loop, row)) {
    throw protocol::NotYet("the loop has not taken its newest command yet. Try again");
  }
  if (!operations_.command_kept(loop)) {
    throw protocol::NotYet("the loop's newest command is not on the disk yet. Try again");
  }
  const rt::InForce now = in_force(runtime, queue);
  Test test{.loop = loop,
            .session = 0,
            .terms = terms,
            .peer = sender.peer,
            .mode = now.mode,
            .set_point = now.set_point,
            .output = row.co,
            .read_back = std::isfinite(row.stem),
            .first_period = row.period_index,
            .next_period = row.period_index,
            .moved = terms.manual ? row.co : now.set_point};
  if (!terms.manual && now.mode != Mode::automatic) {
    throw RequestError("a test by SP needs the loop in automatic");
  }
  const rt::LoopSettings settings = runtime.settings->get();
  const control::OutputLimits& output = settings.controller.output;
  if (terms.any_size && (!terms.manual || sender.socket != SocketName::control)) {
    throw RequestError("any_size is for tests in manual, on control.sock alone");
  }
  if (!terms.any_size && !is_within(terms.pv, settings.pv_check.low, settings.pv_check.high)) {
    throw RequestError("the limits of PV are outside of its range");
  }
  if (!is_within(terms.co, output.low, output.high)) {
    throw RequestError("the limits of CO are outside of those of the loop");
  }
  const double longest_s = terms.any_size ? kLongestOfAny_s : kLongest_s;
  if (!(terms.longest_s > 0.0 && terms.longest_s <= longest_s)) {
    throw RequestError(fmt::format("a test lasts at most {:g} s", longest_s));
  }
  for (const double to : terms.moved) {
    if (const std::string why = why_beyond(test, to); !why.empty()) throw RequestError(why);
  }
  std::string why = why_in_rows(test);
  if (why.empty()) why = why_not_now(test);
  if (!why.empty()) throw RequestError("no test: " + why);
  test.session = runtime.commissioning->take(std::nullopt, sender.peer, plant_.alarms.now_ms(), at,
                                             Commissioning::Purpose::test);
  write_down(test, "begun", terms.plan);
  test_ = std::move(test);
  if (terms.manual && now.mode != Mode::manual &&
      !send(*test_, rt::Command{.mode = Mode::manual})) {
    end(loop, "the loop does not accept manual");
    throw RequestError("the loop does not accept manual");
  }
  return test_->session;
}

// Returns why the test must not move SP or the output to this value.
std::string TestSessions::why_beyond(const Test& test, double to) const {
  const rt::LoopSettings settings = plant_.loops[test.loop].settings->get();
  const control::ControllerSettings& limits = settings.controller;
  const char* const what = test.terms.manual ? "output" : "SP";
  const Range allowed = test.terms.manual ? Range{limits.output.low, limits.output.high}
                                          : Range{limits.set_point.low, limits.set_point.high};
  const double span =
      test.terms.manual ? limits.pid.output_span() : settings.pv_check.high - settings.pv_check.low;
  const double from = test.terms.manual ? test.output : test.set_point;
  if (!inside(to, test.terms.moved)) return outside(what, to, test.terms.moved);
  if (!inside(to, allowed)) return outside(what, to, allowed);
  if (!test.terms.any_size && !(std::abs(to - from) <= kMostMove * span * (1.0 + 1e-9))) {
    return fmt::format("{} {:.4g} is more than {:g} % of its span from {:.4g}", what, to,
                       100.0 * kMostMove, from);
  }
  return {};
}

// Returns why the loop is not fit for a test at present.
std::string TestSessions::why_not_now(const Test& test) const {
  record::RecordRow row;
  if (!plant_.historian.latest(test.loop, row)) return "no cycle has run";
  if (row.fault != control::Fault::none) {
    return fmt::format("the loop has a fault: {}", control::to_text(row.fault));
  }
  if ((row.flags & record::kOutputLost) != 0) return "the device does not take the output";
  if (row.pv_quality != base::Quality::good) return "PV is not good";
  if (test.terms.any_size) return {};
  if ((row.flags & (record::kAtLow | record::kAtHigh)) != 0) return "the output is at its limit";
  std::string why;
  plant_.alarms.look(test.loop, [&](const supervision::AlarmSnapshot& now) {
    for (const alarm::AlarmKind kind : alarm::kProcessAlarms) {
      // In manual before the test, this alarm is the loop's normal state.
      if (kind == alarm::AlarmKind::not_normal_mode && test.mode == Mode::manual) continue;
      if (why.empty() && now.alarms.alarm(kind).active()) {
        why = fmt::format("the process alarm {} is active", alarm::to_text(kind));
      }
    }
  });
  return why;
}

// Returns what in the rows since the last call ends the test.
std::string TestSessions::why_in_rows(Test& test) const {
  for (const TrendRow& row :
       plant_.historian.trend(test.loop, test.next_period, Historian::kKept)) {
    test.next_period = row.period_index + 1;
    if (!inside(row.pv, test.terms.pv)) return outside("PV", row.pv, test.terms.pv);
    if (!inside(row.co, test.terms.co)) return outside("CO", row.co, test.terms.co);
    if (test.read_back && !std::isfinite(row.stem)) return "the read-back of the valve is lost";
    const double passed_s = static_cast<double>(row.period_index - test.first_period) *
                            plant_.loops[test.loop].config.sample_time_s;
    if (passed_s > test.terms.longest_s) return "its time is over";
  }
  return {};
}

void TestSessions::move(std::size_t loop, double to) {
  Test& test = *test_;
  check_command(test);
  if (!test.why.empty()) throw RequestError("the test has ended: " + test.why);
  std::string why = why_beyond(test, to);
  if (!why.empty()) throw RequestError(why);
  if (test.command) throw protocol::NotYet("the loop has not taken the last move yet. Try again");
  why = why_not_now(test);
  if (why.empty()) why = why_in_rows(test);
  if (!why.empty()) {
    end(loop, why);
    throw RequestError("the test has ended: " + why);
  }
  rt::Command command;
  (test.terms.manual ? command.output : command.set_point) = to;
  if (!send(test, command)) throw RequestError("the loop refuses this move");
  test.moved = to;
}

void TestSessions::end(std::size_t loop, const std::string& why) {
  if (!runs_on(loop) || !test_->why.empty()) return;
  test_->why = why;
  test_->ending = test_->terms.manual ? Ending::output : Ending::mode;
  plant_.loops[loop].commissioning->close(test_->session, why);
  write_down(*test_, "ended", why);
}

void TestSessions::tick(Clock::time_point now) {
  if (!test_) return;
  Test& test = *test_;
  LoopRuntime& runtime = plant_.loops[test.loop];
  check_command(test);
  if (!runtime.commissioning->held_by(test.session)) {
    if (test.why.empty()) taken_over(test);
    test_.reset();
    return;
  }
  if (test.why.empty()) {
    const Mode wanted = test.terms.manual ? Mode::manual : Mode::automatic;
    std::string why = why_in_rows(test);
    if (why.empty()) why = why_not_now(test);
    if (commands_.queue(test.loop).availability().mode != wanted) why = "the mode has changed";
    if (runtime.commissioning->silent(now)) why = "no sign of life for 60 s";
    if (!why.empty()) end(test.loop, why);
  }
  if (!test.why.empty()) restore(test, now);
}

// Receives the answer of the loop to the newest command.
void TestSessions::check_command(Test& test) {
  if (!test.command) return;
  const std::optional<commands::Outcome> outcome =
      commands_.queue(test.loop).outcome(*test.command);
  if (!outcome) return;
  test.command.reset();
  if (outcome->why.empty()) return;
  if (test.why.empty()) end(test.loop, outcome->why);
  test.wait_until = {};  // the output did not return
}

void TestSessions::restore(Test& test, Clock::time_point now) {
  if (test.command || now < test.next_try) return;
  test.next_try = now + kBetweenTries;
  if (test.ending == Ending::output) return restore_output(test, now);
  send(test, last_command(test));
}

// Moves the output back, and waits until it has arrived.
void TestSessions::restore_output(Test& test, Clock::time_point now) {
  record::RecordRow row;
  const bool known = plant_.historian.latest(test.loop, row);
  const double span = plant_.loops[test.loop].settings->get().controller.pid.output_span();
  const bool arrived = known && std::abs(row.co - test.output) <= kReturned * span;
  const bool commanded = test.wait_until != Clock::time_point{};
  if (commanded && (arrived || now > test.wait_until)) {
    test.ending = Ending::mode;
    return restore(test, now + kBetweenTries);
  }
  if (commanded) return;
  if (send(test, rt::Command{.mode = Mode::manual, .output = test.output})) {
    test.wait_until = now + kOutputReturns;
  } else if (test.mode == Mode::automatic) {
    // The action of a fault has the output. Automatic continues from there after the fault.
    test.ending = Ending::mode;
    test.next_try = now;
  }
}

// Returns the command that gives the loop its mode and set point back, and releases it. If a fault
// requires manual, the loop waits there.
rt::Command TestSessions::last_command(const Test& test) {
  const bool tracks = plant_.loops[test.loop].settings->get().controller.set_point_tracks_in_manual;
  rt::Command command{.ends_commissioning = true};
  if (test.mode == Mode::manual) {
    command.mode = Mode::manual;
    return command;
  }
  const bool in_manual = commands_.queue(test.loop).availability().mode == Mode::manual;
  command.set_point = test.set_point;
  command.mode = Mode::automatic;
  if ((in_manual && !test.terms.manual) || !commands_.refusal_of(test.loop, command).empty()) {
    command.mode = Mode::manual;
    if (tracks) command.set_point.reset();
  }
  return command;
}

// Somebody took the loop to manual. A set point of the test must not act when they go to automatic.
void TestSessions::taken_over(const Test& test) {
  write_down(test, "ended", "the loop was taken to manual");
  const LoopRuntime& runtime = plant_.loops[test.loop];
  const rt::InForce now = in_force(runtime, commands_.queue(test.loop));
  if (test.terms.manual || test.moved == test.set_point || now.set_point != test.moved ||
      (now.mode == Mode::manual && runtime.settings->get().controller.set_point_tracks_in_manual)) {
    return;
  }
  rt::Command command{.set_point = test.set_point};
  command.expected.set_point = test.moved;
  try {
    commands_.send(test.loop, command, kPeer, "set point before the test");
  } catch (const RequestError&) {  // log and journal have the refusal
  }
}

// Returns false if the command is refused now.
bool TestSessions::send(Test& test, const rt::Command& command) {
  const std::string& peer = test.why.empty() ? test.peer : std::string(kPeer);
  try {
    test.command = commands_.send(test.loop, command, peer, "test").order;
    return true;
  } catch (const RequestError&) {  // log and journal have the refusal
    return false;
  }
}

void TestSessions::write_down(const Test& test, const char* state, const std::string& reason) {
  journal::JournalEntry line = operator_line(plant_, test.loop, test.peer);
  line.kind = journal::JournalEntry::Kind::test;
  line.what = "test";
  line.new_value = state;
  line.result = "done";
  line.reason = reason;
  journal_.post(std::move(line));
}

}  // namespace loopwarden::daemon::console
