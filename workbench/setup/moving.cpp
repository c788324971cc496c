// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/moving.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "base/digest/digest.hpp"
#include "daemon/protocol/ask.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench::setup {

protocol::LoopStatus status_of(DaemonClient& daemon, const std::string& tag) {
  protocol::Status all = protocol::ask(daemon, protocol::StatusRequest{});
  for (protocol::LoopStatus& loop : all.loops) {
    if (loop.name == tag) return std::move(loop);
  }
  throw TestAborted("the daemon does not run " + tag);
}

void check_in_force(const Setup& setup, DaemonClient& daemon) {
  const std::string why = protocol::not_in_force(
      daemon, setup.tag, base::crc32(text_of_file(setup.loop_file())), setup.remedies());
  if (!why.empty()) throw TestAborted(why);
}

bool agreed(Setup& setup, const std::string& what_moves) {
  Dialogue& dialogue = setup.dialogue;
  if (!dialogue.person().has_keys()) {
    throw TestAborted("this step moves the valve: it needs a terminal with an operator");
  }
  DaemonClient daemon(setup.socket);
  check_in_force(setup, daemon);
  dialogue.say("  " + what_moves);
  const std::string typed = dialogue.ask_now(
      fmt::format("  Type {} to continue, or press Enter to skip this step", setup.tag),
      [&](const std::string& answer) -> std::string {
        return answer.empty() || answer == setup.tag ? "" : "type the tag, or only Enter";
      });
  return !typed.empty();
}

namespace {

// Returns whether the present value is within its limits. Otherwise prints both.
bool is_inside(Dialogue& dialogue, const char* name, double value, std::pair<double, double> limits,
               const std::string& unit) {
  if (value >= limits.first && value <= limits.second) return true;
  dialogue.say(fmt::format("  {} is {:.4g} {} now, outside of its limits {:g} to {:g} {}.", name,
                           value, unit, limits.first, limits.second, unit));
  return false;
}

std::pair<double, double> ask_pv_limits(Setup& setup, const protocol::LoopStatus& loop, double pv) {
  return setup.dialogue.range_now(
      fmt::format("  Limits of PV that end the test: lowest and highest, {} (now {:.4g})",
                  loop.pv_unit, pv),
      loop.pv_unit);
}

// Returns the newest cycle. Throws TestAborted without a cycle, or if a value can't be compared
// with limits.
const protocol::Cycle& known_cycle(const protocol::LoopStatus& loop) {
  if (!loop.cycle) throw TestAborted("the loop has not run yet");
  if (!std::isfinite(loop.cycle->pv)) {
    throw TestAborted(fmt::format("PV is not known ({})", loop.cycle->pv_reason));
  }
  return *loop.cycle;
}

}  // namespace

const char* word_of(control::Action action) noexcept {
  return action == control::Action::reverse ? "reverse" : "direct";
}

LiveLimits limits_now(Setup& setup, const protocol::LoopStatus& loop) {
  const protocol::Cycle& cycle = known_cycle(loop);
  if (!std::isfinite(cycle.co)) {
    throw TestAborted("the output is not known: run the step `stroke`, which asks for it");
  }
  for (;;) {
    const auto co = setup.dialogue.range_now(
        fmt::format("  Lowest and highest output, {} (now {:.4g})", loop.co_unit, cycle.co),
        loop.co_unit);
    const auto pv = ask_pv_limits(setup, loop, cycle.pv);
    const bool co_inside = is_inside(setup.dialogue, "CO", cycle.co, co, loop.co_unit);
    const bool pv_inside = is_inside(setup.dialogue, "PV", cycle.pv, pv, loop.pv_unit);
    if (co_inside && pv_inside) return {co.first, co.second, pv.first, pv.second};
  }
}

LiveLimits pv_limits_now(Setup& setup, const protocol::LoopStatus& loop) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const double now = known_cycle(loop).pv;
  for (;;) {
    const auto pv = ask_pv_limits(setup, loop, now);
    if (is_inside(setup.dialogue, "PV", now, pv, loop.pv_unit)) {
      return {-kAny, kAny, pv.first, pv.second};
    }
  }
}

double check_inside(const protocol::LoopStatus& loop, const LiveLimits& limits) {
  const protocol::Cycle& cycle = known_cycle(loop);
  if (cycle.fault != "none") throw TestAborted("the loop has a fault: " + cycle.fault);
  if (!(cycle.co >= limits.co_low && cycle.co <= limits.co_high && cycle.pv >= limits.pv_low &&
        cycle.pv <= limits.pv_high)) {
    throw TestAborted(fmt::format("the loop is now outside its limits: CO {:.4g}, PV {:.4g}",
                                  cycle.co, cycle.pv));
  }
  return cycle.co;
}

Session::Session(const std::string& socket, std::string tag)
    : daemon_(socket),
      tag_(std::move(tag)),
      id_(protocol::ask(daemon_, protocol::CommissioningRequest{.loop = tag_}).session),
      told_(std::chrono::steady_clock::now()) {}

Session::~Session() {
  if (abandoned_) return;
  try {
    protocol::CommissioningRequest request{.loop = tag_};
    request.session = id_;
    request.end = true;
    protocol::ask(daemon_, request);
  } catch (const std::exception&) {
    // The daemon ends it by itself.
  }
}

void Session::alive() {
  constexpr std::chrono::seconds kBetween{5};
  const auto now = std::chrono::steady_clock::now();
  if (now - told_ < kBetween) return;
  protocol::CommissioningRequest request{.loop = tag_};
  request.session = id_;
  protocol::ask(daemon_, request);
  told_ = now;
}

void Session::withhold(double seconds) {
  protocol::CommissioningRequest request{.loop = tag_};
  request.session = id_;
  request.withhold_s = seconds;
  protocol::ask(daemon_, request);
}

void Session::set(protocol::SetRequest request) {
  request.loop = tag_;
  request.session = id_;
  daemon_.set(request);
}

void Session::guard(LiveLimits& limits, AbortKey& key) {
  limits.session = id_;
  limits.watch = [this, &key] {
    alive();
    return key.pressed();
  };
  limits.not_put_back = [this] { abandon(); };
}

AbortKey::AbortKey(Person& person) : person_(person) {
  watch_interrupts();
  person_.watch_keys(true);
}

std::string AbortKey::pressed() {
  if (interrupted()) return "interrupted";
  return person_.key(std::chrono::milliseconds(0)) ? "a key was pressed" : "";
}

}  // namespace loopwarden::workbench::setup
