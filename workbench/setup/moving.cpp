// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/moving.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "protocol/ask.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench::setup {

protocol::LoopStatus status_of(DaemonClient& daemon, const std::string& tag) {
  protocol::Status all = protocol::ask(daemon, protocol::StatusRequest{});
  for (protocol::LoopStatus& loop : all.loops) {
    if (loop.name == tag) return std::move(loop);
  }
  throw TestAborted("the daemon does not run " + tag);
}

bool agreed(Setup& setup, const std::string& what_moves) {
  Dialogue& dialogue = setup.dialogue;
  if (!dialogue.person().has_keys()) {
    throw TestAborted("this step moves the valve: it needs a terminal, and a person at its keys");
  }
  dialogue.say("  " + what_moves);
  const std::string typed =
      dialogue.ask_now(fmt::format("  Type {} to go on, or Enter to leave this step", setup.tag),
                       [&](const std::string& answer) -> std::string {
                         return answer.empty() || answer == setup.tag ? "" : "the tag, or nothing";
                       });
  return !typed.empty();
}

LiveLimits limits_now(Setup& setup, const protocol::LoopStatus& loop) {
  Dialogue& dialogue = setup.dialogue;
  const protocol::Cycle cycle = loop.cycle.value_or(protocol::Cycle{});
  for (;;) {
    const auto co = dialogue.range_now(
        fmt::format("  Lowest and highest output, {} (now {:.4g})", loop.co_unit, cycle.co));
    const auto pv = dialogue.range_now(fmt::format(
        "  It ends where PV leaves: lowest and highest, {} (now {:.4g})", loop.pv_unit, cycle.pv));
    const bool inside = cycle.co >= co.first && cycle.co <= co.second && cycle.pv >= pv.first &&
                        cycle.pv <= pv.second;
    if (inside) return {co.first, co.second, pv.first, pv.second};
    dialogue.say("  The loop stands outside of them.");
  }
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
