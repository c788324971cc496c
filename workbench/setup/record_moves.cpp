// SPDX-License-Identifier: Apache-2.0
// Twenty minutes in automatic with moves of the set point, for the twin. Of a loop that another controller runs the person
// moves it there, and this tells him when.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <optional>
#include <thread>

#include "protocol/ask.hpp"
#include "workbench/setup/moving.hpp"

namespace loopwarden::workbench::setup {
namespace {

// In sizes of the move, one after the other, each for the same time: a few in each direction, and some twice as large.
constexpr std::array kPlan{0.0, 1.0, 0.0, -1.0, 0.0, 1.0, -1.0, 1.0, 0.0, -1.0, 0.0};

struct Limits {
  double low, high;  // PV units
};

// The daemon's record of the loop, ended however this ends.
class CsvRecord {
 public:
  CsvRecord(DaemonClient& daemon, const std::string& tag) : daemon_(daemon), tag_(tag) {
    const std::time_t now = std::time(nullptr);
    protocol::RecordRequest request{.loop = tag};
    request.start = fmt::format("{}-setup-{:%Y%m%dT%H%M%SZ}", tag, fmt::gmtime(now));
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

// The loop in automatic, and back in manual where its output stands then.
class InAutomatic {
 public:
  InAutomatic(Session& session, double set_point) : session_(session) {
    try {
      session_.set({.set_point = set_point, .mode = "auto"});
    } catch (const std::exception&) {
      // It may have been taken though its answer was lost.
      put_back();
      throw;
    }
  }
  InAutomatic(const InAutomatic&) = delete;
  InAutomatic& operator=(const InAutomatic&) = delete;
  ~InAutomatic() { put_back(); }
  void move(double set_point) { session_.set({.set_point = set_point}); }

 private:
  void put_back() noexcept {
    try {
      session_.set({.mode = "man"});
    } catch (const std::exception&) {
      session_.abandon();  // then the daemon takes it there by itself
    }
  }

  Session& session_;
};

// Calls `move` for each part of the plan, in the loop's own time. Throws TestAborted.
template <class Move, class Watch>
void go_through(Setup& setup, DaemonClient& daemon, const Limits& limits, bool ours, Move move,
                Watch watch) {
  const double part_s = setup.record_minutes * 60.0 / static_cast<double>(kPlan.size());
  double next_s = status_of(daemon, setup.tag).cycle.value_or(protocol::Cycle{}).time_s;
  for (const double offset : kPlan) {
    move(offset);
    next_s += part_s;
    for (protocol::Cycle now{}; now.time_s < next_s;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      if (const std::string why = watch(); !why.empty()) throw TestAborted(why);
      now = status_of(daemon, setup.tag).cycle.value_or(protocol::Cycle{});
      if (!(now.pv >= limits.low && now.pv <= limits.high)) {
        throw TestAborted(fmt::format("PV {:.4g} left its limits", now.pv));
      }
      if (ours && (now.fault != "none" || now.requested_mode != "AUTO")) {
        throw TestAborted(fmt::format("the loop is no longer in automatic (mode {}, fault {})",
                                      now.mode, now.fault));
      }
    }
  }
}

}  // namespace

Outcome record_moves(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  const config::LoopConfig loop = setup.loop();
  const bool ours = !setup.elsewhere();
  if (ours &&
      !agreed(setup, fmt::format("The loop goes to automatic with its gains as they are, and "
                                 "its set point moves for {:g} minutes. Then it is in manual. "
                                 "Any key ends it.",
                                 setup.record_minutes))) {
    return Outcome::left;
  }
  if (!ours &&
      !dialogue.yes_now(fmt::format("  Can you move the set point at its own controller, in "
                                    "automatic, for {:g} minutes",
                                    setup.record_minutes))) {
    return Outcome::left;
  }
  DaemonClient daemon(setup.socket);
  const protocol::LoopStatus before = status_of(daemon, setup.tag);
  const protocol::Cycle cycle = before.cycle.value_or(protocol::Cycle{});
  const double span = loop.pv.high - loop.pv.low;
  const double middle = dialogue.number_now(
      fmt::format("  Set point to move around, {} (PV is {:.4g})", loop.pv_unit, cycle.pv));
  const double size = dialogue.number_now(
      fmt::format("  Size of a move, {} (3 to 5 % of the span: {:.3g} to {:.3g})", loop.pv_unit,
                  0.03 * span, 0.05 * span));
  const auto [low, high] = dialogue.range_now(
      fmt::format("  It ends where PV leaves: lowest and highest, {}", loop.pv_unit));
  if (!(size > 0.0 && middle - size > low && middle + size < high)) {
    throw TestAborted("the moves, above 0, lie within the limits of PV");
  }
  const Limits limits{low, high};
  std::optional<Session> session;
  if (ours) session.emplace(setup.socket, setup.tag);
  AbortKey key(dialogue.person());
  std::string file;
  {
    std::optional<InAutomatic> automatic;
    if (session) automatic.emplace(*session, middle);
    const CsvRecord record(daemon, setup.tag);
    file = record.file();
    const auto began = std::chrono::steady_clock::now();
    go_through(
        setup, daemon, limits, ours,
        [&](double offset) {
          const double wanted = middle + offset * size;
          const double minutes =
              std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() /
              60.0;
          dialogue.say(fmt::format("  {:5.1f} min: {} {:.5g} {}", minutes,
                                   ours ? "set point" : "now move the set point to", wanted,
                                   loop.pv_unit));
          if (automatic) automatic->move(wanted);
        },
        [&] {
          if (session) session->alive();
          return key.pressed();
        });
  }
  dialogue.say("  " + file);
  setup.state().set_found("record", file);
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
