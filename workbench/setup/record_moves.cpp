// SPDX-License-Identifier: Apache-2.0
// Records twenty minutes in automatic with moves of the set point, for the twin. If another
// controller runs the loop, the person makes the moves there, and this step tells the person when.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "daemon/protocol/ask.hpp"
#include "workbench/setup/moving.hpp"

namespace loopwarden::workbench::setup {
namespace {

// The plan of set points in sizes of the move, each held for the same time: a few in each
// direction, and some twice as large.
constexpr std::array kPlan{0.0, 1.0, 0.0, -1.0, 0.0, 1.0, -1.0, 1.0, 0.0, -1.0, 0.0};
constexpr double kMargin_s = 120.0;  // additional time for the moves

// The daemon's record of the loop. The destructor ends it. If this process dies, the daemon ends it
// when the commissioning session ends, and at the latest after `at_most_s`.
class CsvRecord {
 public:
  CsvRecord(DaemonClient& daemon, const std::string& tag, double at_most_s)
      : daemon_(daemon), tag_(tag) {
    const std::time_t now = std::time(nullptr);
    protocol::RecordRequest request{.loop = tag};
    request.start = fmt::format("{}-setup-{:%Y%m%dT%H%M%SZ}", tag, fmt::gmtime(now));
    request.at_most_s = at_most_s;
    file_ = protocol::ask(daemon_, request).file;
  }
  CsvRecord(const CsvRecord&) = delete;
  CsvRecord& operator=(const CsvRecord&) = delete;
  ~CsvRecord() {
    try {
      protocol::RecordRequest request{.loop = tag_};
      request.stop = true;
      protocol::ask(daemon_, request);
    } catch (const std::exception&) {
      // The daemon is gone, and the record with it.
    }
  }
  const std::string& file() const noexcept { return file_; }

 private:
  DaemonClient& daemon_;
  std::string tag_, file_;
};

// Takes the loop to automatic. The destructor returns it to manual: with the present output after
// all moves, otherwise with the earlier output.
class InAutomatic {
 public:
  InAutomatic(Setup& setup, Session& session, double output, double set_point)
      : dialogue_(setup.dialogue), session_(session), output_(output) {
    try {
      session_.set({.set_point = set_point, .mode = "auto"});
    } catch (const std::exception&) {
      // The daemon may have taken the command although its answer was lost.
      put_back();
      throw;
    }
  }
  InAutomatic(const InAutomatic&) = delete;
  InAutomatic& operator=(const InAutomatic&) = delete;
  ~InAutomatic() { put_back(); }
  void move(double set_point) { session_.set({.set_point = set_point}); }
  void all_moved() noexcept { all_moved_ = true; }

 private:
  void put_back() noexcept {
    try {
      if (all_moved_) {
        session_.set({.mode = "man"});
        return;
      }
      session_.set({.output = output_, .mode = "man"});
      dialogue_.say(fmt::format("  Manual, output back to {:.4g}.", output_));
    } catch (const std::exception& e) {
      abandon(e.what());
    }
  }
  // Used if, for example, the action for a fault has the output. The mode is set anyway.
  void abandon(const char* why) noexcept {
    session_.abandon();
    try {
      dialogue_.say(fmt::format("  The output could not be returned to {:.4g}: {}", output_, why));
      session_.set({.mode = "man"});
    } catch (const std::exception&) {  // the daemon does it without a command
    }
  }

  Dialogue& dialogue_;
  Session& session_;
  double output_;  // CO units, before
  bool all_moved_ = false;
};

// Watches the loop in its own time. Throws TestAborted if the step must end.
class Watched {
 public:
  Watched(Setup& setup, DaemonClient& daemon, const LiveLimits& limits, bool ours,
          std::function<std::string()> must_end)
      : setup_(setup),
        daemon_(daemon),
        limits_(limits),
        ours_(ours),
        must_end_(std::move(must_end)) {
    const protocol::Cycle now = status_of(daemon, setup.tag).cycle.value_or(protocol::Cycle{});
    time_s_ = now.time_s;
    next_period_ = now.period + 1;
  }

  // Waits until `until_s` of the loop's time, or until `seen` returns that it is enough.
  template <class Seen>
  void wait(double until_s, Seen seen) {
    while (time_s_ < until_s) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      if (const std::string why = must_end_(); !why.empty()) throw TestAborted(why);
      check_limits();
      const protocol::Cycle now = status_of(daemon_, setup_.tag).cycle.value_or(protocol::Cycle{});
      if (ours_ && (now.fault != "none" || now.requested_mode != "AUTO")) {
        throw TestAborted(fmt::format("the loop is no longer in automatic (mode {}, fault {})",
                                      now.mode, now.fault));
      }
      time_s_ = now.time_s;
      if (seen(now)) return;
    }
  }
  double time_s() const noexcept { return time_s_; }

 private:
  // Checks every cycle since the last call.
  void check_limits() {
    const protocol::Trend fresh =
        protocol::ask(daemon_, protocol::TrendRequest{.loop = setup_.tag, .from = next_period_});
    for (std::size_t i = 0; i < fresh.period.size(); ++i) {
      next_period_ = fresh.period[i] + 1;
      const double pv = fresh.pv[i];
      const double co = fresh.co[i];
      if (!(pv >= limits_.pv_low && pv <= limits_.pv_high)) {
        throw TestAborted(fmt::format("PV {:.4g} left its limits", pv));
      }
      if (ours_ && !(co >= limits_.co_low && co <= limits_.co_high)) {
        throw TestAborted(fmt::format("CO {:.4g} left its limits", co));
      }
    }
  }

  Setup& setup_;
  DaemonClient& daemon_;
  const LiveLimits& limits_;
  bool ours_;
  std::function<std::string()> must_end_;
  double time_s_ = 0.0;
  std::uint64_t next_period_ = 0;
};

// The action that a stroke has shown is valid until setup writes another file, even if the stroke
// refused the file.
void check_action(Setup& setup, const config::LoopConfig& loop) {
  const std::string proven = setup.state().found("action");
  if (proven.empty()) {
    setup.dialogue.say("  No stroke has shown that controller.action is right.");
  } else if (proven != word_of(loop.controller.pid.action)) {
    throw TestAborted(fmt::format(
        "the stroke has shown that controller.action must be {}, {} has {}. Correct the file, or "
        "{}",
        proven, loop.file, word_of(loop.controller.pid.action), setup.command("stroke")));
  }
}

// Waits until PV has been near the set point for a while. This time is not part of the record.
void settle(Watched& loop, double set_point, double near) {
  constexpr double kLongest_s = 900.0;
  constexpr double kStays_s = 20.0;
  double since_s = loop.time_s();
  bool there = false;
  loop.wait(loop.time_s() + kLongest_s, [&](const protocol::Cycle& now) {
    if (std::abs(now.pv - set_point) > near) since_s = now.time_s;
    there = now.time_s - since_s > kStays_s;
    return there;
  });
  if (!there) {
    throw TestAborted(fmt::format(
        "PV does not stay within {:.3g} of {:.4g}. Check the gains and the valve before you record",
        near, set_point));
  }
}

}  // namespace

Outcome record_moves(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  const config::LoopConfig loop = setup.loop();
  const bool ours = !setup.elsewhere();
  const std::string minutes = fmt::format("{:g} {}", setup.record_minutes,
                                          setup.record_minutes == 1.0 ? "minute" : "minutes");
  if (ours &&
      !agreed(setup, fmt::format("The loop is put in automatic with its present gains, and "
                                 "its set point moves for {}. Then it is in manual. "
                                 "Any key ends it, and the output returns to its present value.",
                                 minutes))) {
    return Outcome::left;
  }
  if (!ours &&
      !dialogue.yes_now(fmt::format("  Can you move the set point at its own controller, in "
                                    "automatic, for {}",
                                    minutes))) {
    return Outcome::left;
  }
  DaemonClient daemon(setup.socket);
  if (ours) {
    check_action(setup, loop);
  } else {
    check_in_force(setup, daemon);
  }
  const protocol::LoopStatus before = status_of(daemon, setup.tag);
  const protocol::Cycle cycle = before.cycle.value_or(protocol::Cycle{});
  const double span = loop.pv.high - loop.pv.low;
  const double middle = dialogue.number_now(
      fmt::format("  Set point to move around, {} (PV is {:.4g})", loop.pv_unit, cycle.pv),
      loop.pv_unit);
  const double size = dialogue.number_now(
      fmt::format("  Size of a move, {} (3 to 5 % of the span: {:.3g} to {:.3g})", loop.pv_unit,
                  0.03 * span, 0.05 * span),
      loop.pv_unit);
  LiveLimits limits = ours ? limits_now(setup, before) : pv_limits_now(setup, before);
  if (!(size > 0.0 && middle - size > limits.pv_low && middle + size < limits.pv_high)) {
    throw TestAborted("the moves, above 0, lie within the limits of PV");
  }
  const auto& allowed = loop.controller.set_point;
  if (ours && !(middle - size >= allowed.low && middle + size <= allowed.high)) {
    throw TestAborted(fmt::format("the moves lie within the limits of the set point, {:g} to {:g}",
                                  allowed.low, allowed.high));
  }
  std::optional<Session> session;
  double output = cycle.co;  // CO units, to return to
  if (ours) {
    session.emplace(setup.socket, setup.tag);
    check_in_force(setup, daemon);
    output = check_inside(status_of(daemon, setup.tag), limits);
  }
  AbortKey key(dialogue.person());
  std::string file;
  {
    std::optional<InAutomatic> automatic;
    if (session) automatic.emplace(setup, *session, output, middle);
    Watched watched(setup, daemon, limits, ours, [&] {
      if (session) session->alive();
      return key.pressed();
    });
    dialogue.say(fmt::format("  {} to {:.5g} {}; the record begins when PV is there",
                             ours ? "Set point goes" : "Move the set point", middle, loop.pv_unit));
    settle(watched, middle, size);
    const CsvRecord record(daemon, setup.tag, setup.record_minutes * 60.0 + kMargin_s);
    file = record.file();
    const double part_s = setup.record_minutes * 60.0 / static_cast<double>(kPlan.size());
    const double begin_s = watched.time_s();
    for (std::size_t i = 0; i < kPlan.size(); ++i) {
      const double wanted = middle + kPlan[i] * size;
      dialogue.say(fmt::format("  {:5.1f} min: {} {:.5g} {}", (watched.time_s() - begin_s) / 60.0,
                               ours ? "set point" : "now move the set point to", wanted,
                               loop.pv_unit));
      if (automatic) automatic->move(wanted);
      watched.wait(begin_s + part_s * static_cast<double>(i + 1),
                   [](const protocol::Cycle&) { return false; });
    }
    if (automatic) automatic->all_moved();
  }
  dialogue.say("  " + file);
  setup.state().set_found("record", file);
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
