// SPDX-License-Identifier: Apache-2.0
// Stops the commands and checks that the device moves the valve. After a failure of cable, box or
// power, only the device can.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/protocol/ask.hpp"
#include "workbench/setup/moving.hpp"
#include "workbench/setup/questions.hpp"
#include "workbench/setup/silence.hpp"

namespace loopwarden::workbench::setup {
namespace {

using Clock = std::chrono::steady_clock;

// Returns why PV is outside of its limits; empty: it is inside.
std::string left(const LiveLimits& limits, double pv) {
  const bool inside = pv >= limits.pv_low && pv <= limits.pv_high;
  return inside ? "" : fmt::format("PV {:.4g} left its limits", pv);
}

// Returns the value at the end of a hold: the mean of its last fifth.
double mean_at_end(const std::vector<BenchRow>& rows, double BenchRow::*value) {
  const std::size_t count = std::max<std::size_t>(1, rows.size() / 5);
  double sum = 0.0;
  for (std::size_t k = rows.size() - count; k < rows.size(); ++k) sum += rows[k].*value;
  return sum / static_cast<double>(count);
}

class Quiet {
 public:
  Quiet(Setup& setup, Session& session, AbortKey& key, const LiveLimits& limits)
      : tag_(setup.tag), session_(session), key_(key), limits_(limits), daemon_(setup.socket) {}

  // Throws TestAborted after it has resumed the commands. `see` receives each sample's time since
  // the last command, its stem and its PV.
  template <class See>
  void last(double seconds, See see) {
    const protocol::Cycle now = status_of(daemon_, tag_).cycle.value_or(protocol::Cycle{});
    const std::uint64_t from = now.period + 1;
    std::uint64_t next = from;
    session_.withhold(seconds);
    const Clock::time_point begin = Clock::now();
    while (std::chrono::duration<double>(Clock::now() - begin).count() < seconds) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      session_.alive();
      if (const std::string why = key_.pressed(); !why.empty()) resume(why);
      const protocol::Trend fresh =
          protocol::ask(daemon_, protocol::TrendRequest{.loop = tag_, .from = next});
      for (std::size_t i = 0; i < fresh.period.size(); ++i) {
        next = fresh.period[i] + 1;
        if (const std::string why = left(limits_, fresh.pv[i]); !why.empty()) resume(why);
        see(static_cast<double>(fresh.period[i] - from) * fresh.sample_time_s, fresh.stem[i],
            fresh.pv[i]);
      }
    }
  }

 private:
  [[noreturn]] void resume(const std::string& why) {
    session_.withhold(0.001);
    throw TestAborted(why);
  }

  std::string tag_;
  Session& session_;
  AbortKey& key_;
  const LiveLimits& limits_;
  DaemonClient daemon_;
};

// Waits until the loop has its output again, because the output can't be restored without it. A
// reason to end the test is thrown afterwards. `why`: a reason that has already ended the test.
void wait_for_output(Setup& setup, Session& session, AbortKey& key, const LiveLimits& limits,
                     double patience_s, std::string why) {
  DaemonClient daemon(setup.socket);
  const auto until = Clock::now() + std::chrono::duration<double>(patience_s);
  for (;;) {
    const protocol::Cycle now = status_of(daemon, setup.tag).cycle.value_or(protocol::Cycle{});
    if (why.empty()) {
      why = key.pressed();
      if (why.empty()) why = left(limits, now.pv);
      if (!why.empty()) setup.dialogue.say("  Ends as soon as the loop has its output: " + why);
    }
    if (now.fault == "none") break;
    if (Clock::now() > until) {
      session.abandon();  // further commands may not reach the valve
      throw TestAborted(why + (why.empty() ? "" : "; ") + "the loop does not get its output back");
    }
    session.alive();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  if (!why.empty()) throw TestAborted(why);
}

}  // namespace

Outcome test_watchdog(Setup& setup) {
  using hal::modbus::CommLossProtection;
  if (setup.elsewhere()) return Outcome::not_needed;
  Dialogue& dialogue = setup.dialogue;
  const config::LoopConfig loop = setup.loop();
  const auto* io = std::get_if<hal::modbus::LoopModbusSettings>(&loop.io);
  if (io == nullptr || io->comm_loss.protection == CommLossProtection::none_accepted) {
    dialogue.say(
        "  The loop's file names no watchdog of a device. If the cable is cut, the valve stays "
        "where it is.");
    return Outcome::not_needed;
  }
  const double timeout_s = io->comm_loss.timeout_s;
  // One command may be on its way.
  const double on_its_way_s = static_cast<double>(io->poll_period_ns) * 1e-9;
  const double silent_s = timeout_s + on_its_way_s + 5.0;
  constexpr double kLongest_s = 300.0;  // for which the daemon withholds commands
  if (silent_s > kLongest_s) {
    dialogue.say(fmt::format(
        "  {:g} s is too long for this test. Disconnect the cable and observe the valve.",
        timeout_s));
    return Outcome::left;
  }
  if (!agreed(
          setup,
          fmt::format("The loop is put in manual, and no command is sent for {:.0f} s. The device "
                      "must then move the valve by itself, after {:g} s. Any key ends it.",
                      silent_s, timeout_s))) {
    return Outcome::left;
  }
  const double home = dialogue.number_now(
      fmt::format("  Where the device takes the valve by itself, {}", loop.co_unit), loop.co_unit);
  const double span = loop.controller.pid.output_span();
  DaemonClient daemon(setup.socket);
  LiveLimits limits = limits_now(setup, status_of(daemon, setup.tag));
  const std::string from_text = without_unit(
      dialogue.ask_now(fmt::format("  The output to begin at, within these limits and well away "
                                   "from there, {}",
                                   loop.co_unit),
                       [&](const std::string& answer) -> std::string {
                         const auto value = numbers_in(without_unit(answer, loop.co_unit), 1);
                         const bool good = value && value->front() >= limits.co_low &&
                                           value->front() <= limits.co_high &&
                                           std::abs(value->front() - home) > 0.05 * span;
                         return good ? ""
                                     : fmt::format(
                                           "a number from {:g} to {:g}, more than {:.4g} "
                                           "(5 % of the span) away from {:g} {}",
                                           limits.co_low, limits.co_high, 0.05 * span, home,
                                           loop.co_unit);
                       }),
      loop.co_unit);
  double stem = std::numeric_limits<double>::quiet_NaN();  // at the end
  bool fitted = false;
  std::optional<Silence> seen;
  {
    Session session(setup.socket, setup.tag);
    check_in_force(setup, daemon);
    AbortKey key(dialogue.person());
    session.guard(limits, key);
    LiveBench bench(setup.socket, setup.tag, limits);
    constexpr double kSettle_s = 10.0;
    const std::vector<BenchRow> rows =
        bench.hold(numbers_in(from_text, 1).value().front(), kSettle_s);
    const double stem_before = mean_at_end(rows, &BenchRow::stem);
    fitted = std::isfinite(stem_before);
    constexpr double kShare = 0.02;
    seen.emplace(
        Silence::Settings{.before = fitted ? stem_before : mean_at_end(rows, &BenchRow::pv),
                          .least = kShare * (fitted ? span : loop.pv.high - loop.pv.low),
                          .written_s = on_its_way_s,
                          .timeout_s = timeout_s});
    dialogue.say(fitted ? "  Commands cease now."
                        : "  Commands cease now. The valve has no read-back: watch it.");
    std::string ended;
    try {
      Quiet(setup, session, key, limits).last(silent_s, [&](double time_s, double at, double pv) {
        stem = at;
        seen->see(time_s, fitted ? at : pv);
      });
    } catch (const TestAborted& e) {
      ended = e.what();
    }
    dialogue.say("  Commands go out again.");
    wait_for_output(setup, session, key, limits, silent_s + loop.safety.recovery_delay_s + 10.0,
                    ended);
  }
  if (const std::string why = seen->why_not(); !why.empty()) {
    throw TestAborted(fmt::format(
        "{}. The device's watchdog is off, its time is not {:g} s, or reading resets it: the "
        "daemon continues to read, which resets the watchdog of some devices. Set the watchdog, or "
        "disconnect the cable and observe the valve, or state comm_loss: none_accepted in {}",
        why, timeout_s, loop.file));
  }
  if (!fitted) {
    stem = dialogue.number_now(
        fmt::format("  The valve's position just before the commands resumed, {}", loop.co_unit),
        loop.co_unit);
  }
  const std::string found =
      fmt::format("the device moved the valve {:.1f} s after the last order, to {:.4g} {}{}",
                  *seen->moved_after_s(), stem, loop.co_unit, fitted ? "" : " as seen by eye");
  if (std::abs(stem - home) > 0.05 * span) {
    throw TestAborted(found + fmt::format(", and not to {:g}: its fail-safe position is another "
                                          "one, or the valve is slow",
                                          home));
  }
  dialogue.say("  " + found);
  setup.state().set_found("watchdog", found);
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
