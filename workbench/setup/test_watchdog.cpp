// SPDX-License-Identifier: Apache-2.0
// Commands cease, and the device has to move the valve by itself: nothing else does when cable, box or power are gone.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <thread>

#include "protocol/ask.hpp"
#include "workbench/setup/moving.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {
namespace {

using Clock = std::chrono::steady_clock;

// What the valve did while no command came.
struct Seen {
  std::optional<double> moved_after_s;  // since the commands ceased
  double stem = 0.0;                    // at the end, CO units
};

class Silence {
 public:
  Silence(Setup& setup, Session& session, AbortKey& key, const config::LoopConfig& loop,
          const LiveLimits& limits)
      : session_(session), key_(key), loop_(loop), limits_(limits), daemon_(setup.socket) {}

  // Throws TestAborted, with the commands going out again.
  Seen last(double seconds, double stem_before, double pv_before) {
    const std::uint64_t from =
        status_of(daemon_, loop_.name).cycle.value_or(protocol::Cycle{}).period + 1;
    next_ = from;
    session_.withhold(seconds);
    Seen seen{.moved_after_s = std::nullopt, .stem = stem_before};
    const Clock::time_point begin = Clock::now();
    while (std::chrono::duration<double>(Clock::now() - begin).count() < seconds) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      session_.alive();
      if (const std::string why = key_.pressed(); !why.empty()) resume(why);
      const protocol::Trend fresh =
          protocol::ask(daemon_, protocol::TrendRequest{.loop = loop_.name, .from = next_});
      for (std::size_t i = 0; i < fresh.period.size(); ++i) {
        next_ = fresh.period[i] + 1;
        const double pv = fresh.pv[i];
        if (pv < limits_.pv_low || pv > limits_.pv_high) {
          resume(fmt::format("PV {:.4g} left its limits", pv));
        }
        const double after_s = static_cast<double>(fresh.period[i] - from) * fresh.sample_time_s;
        if (std::isfinite(fresh.stem[i])) seen.stem = fresh.stem[i];
        if (!seen.moved_after_s && moved(fresh.stem[i], stem_before, pv, pv_before)) {
          seen.moved_after_s = after_s;
        }
      }
    }
    return seen;
  }

 private:
  // By 2 % of a span; by PV where no read-back tells.
  bool moved(double stem, double stem_before, double pv, double pv_before) const {
    constexpr double kShare = 0.02;
    const control::PidSettings& pid = loop_.controller.pid;
    if (std::isfinite(stem_before)) {
      return std::abs(stem - stem_before) > kShare * pid.output_span();
    }
    return std::abs(pv - pv_before) > kShare * (loop_.pv.high - loop_.pv.low);
  }
  [[noreturn]] void resume(const std::string& why) {
    session_.withhold(0.001);
    throw TestAborted(why);
  }

  Session& session_;
  AbortKey& key_;
  const config::LoopConfig& loop_;
  const LiveLimits& limits_;
  DaemonClient daemon_;
  std::uint64_t next_ = 0;
};

// Until the loop has its output again, so that it can be put back.
void wait_for_output(Setup& setup, Session& session, double patience_s) {
  DaemonClient daemon(setup.socket);
  const auto until = Clock::now() + std::chrono::duration<double>(patience_s);
  while (status_of(daemon, setup.tag).cycle.value_or(protocol::Cycle{}).fault != "none") {
    if (Clock::now() > until) throw TestAborted("the loop does not get its output back");
    session.alive();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace

Outcome test_watchdog(Setup& setup) {
  using hal::modbus::CommLossProtection;
  if (setup.elsewhere()) return Outcome::not_needed;
  Dialogue& dialogue = setup.dialogue;
  const config::LoopConfig loop = setup.loop();
  const auto* io = std::get_if<hal::modbus::LoopModbusSettings>(&loop.io);
  if (io == nullptr || io->comm_loss.protection == CommLossProtection::none_accepted) {
    dialogue.say("  Its file names no watchdog of a device: with the cable out the valve stays.");
    return Outcome::not_needed;
  }
  const double timeout_s = io->comm_loss.timeout_s;
  // A command is repeated until it is too old; then the watchdog's time begins.
  const double repeated_s = static_cast<double>(hal::modbus::max_command_age_ns(*io)) * 1e-9;
  const double silent_s = timeout_s + repeated_s + 5.0;
  constexpr double kLongest_s = 300.0;  // that the daemon withholds commands
  if (silent_s > kLongest_s) {
    dialogue.say(
        fmt::format("  {:g} s are too long for this test: pull the cable, and look.", timeout_s));
    return Outcome::left;
  }
  if (!agreed(setup, fmt::format(
                         "The loop goes to manual, and no command is sent for {:.0f} s. The device "
                         "must then move the valve by itself, after {:g} s. Any key ends it.",
                         silent_s, timeout_s))) {
    return Outcome::left;
  }
  const double home = dialogue.number_now(
      fmt::format("  Where the device takes the valve by itself, {}", loop.co_unit));
  const double span = loop.controller.pid.output_span();
  DaemonClient daemon(setup.socket);
  LiveLimits limits = limits_now(setup, status_of(daemon, setup.tag));
  const std::string from_text =
      dialogue.ask_now(fmt::format("  The output to begin at, within these limits and well away "
                                   "from there, {}",
                                   loop.co_unit),
                       [&](const std::string& answer) -> std::string {
                         const auto value = numbers_in(answer, 1);
                         const bool good = value && value->front() >= limits.co_low &&
                                           value->front() <= limits.co_high &&
                                           std::abs(value->front() - home) > 0.05 * span;
                         return good ? "" : "within the limits, more than 5 % of the span away";
                       });
  Session session(setup.socket, setup.tag);
  AbortKey key(dialogue.person());
  limits.session = session.id();
  limits.watch = [&] {
    session.alive();
    return key.pressed();
  };
  Seen seen;
  bool fitted = false;
  {
    LiveBench bench(setup.socket, setup.tag, limits);
    constexpr double kSettle_s = 10.0;
    const std::vector<BenchRow> rows =
        bench.hold(numbers_in(from_text, 1).value().front(), kSettle_s);
    fitted = std::isfinite(rows.back().stem);
    dialogue.say("  Commands cease now.");
    try {
      seen = Silence(setup, session, key, loop, limits)
                 .last(silent_s, rows.back().stem, rows.back().pv);
    } catch (const TestAborted&) {
      wait_for_output(setup, session, silent_s);
      throw;
    }
    dialogue.say("  Commands go out again.");
    wait_for_output(setup, session, silent_s + loop.safety.recovery_delay_s + 10.0);
  }
  if (!seen.moved_after_s) {
    throw TestAborted(
        fmt::format("the valve did not move in {:.0f} s: the device's watchdog is off, "
                    "or its time is not {:g} s. Set it, or state comm_loss: "
                    "none_accepted in {}",
                    silent_s, timeout_s, loop.file));
  }
  std::string found =
      fmt::format("the device moved the valve {:.1f} s after the last order", *seen.moved_after_s);
  if (fitted) {
    found += fmt::format(", to {:.4g} {}", seen.stem, loop.co_unit);
    if (std::abs(seen.stem - home) > 0.05 * span) {
      throw TestAborted(found + fmt::format(", and not to {:g}: its fail-safe position is another "
                                            "one, or the valve is slow",
                                            home));
    }
  }
  dialogue.say("  " + found);
  setup.state().set_found("watchdog", found);
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
