// SPDX-License-Identifier: Apache-2.0
// Moves the valve to the lower limit, up, down again and back, all in steps. The response of PV
// shows whether the controller's action is right.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>
#include <vector>

#include "daemon/protocol/ask.hpp"
#include "workbench/setup/moving.hpp"

namespace loopwarden::workbench::setup {
namespace {

constexpr double kParts = 4.0;  // between the limits, each way

struct Held {
  double co, stem, pv;  // at its end
};

Held hold(TestBench& bench, double co, double seconds) {
  const std::vector<BenchRow> rows = bench.hold(co, seconds);
  // The mean of the last fifth.
  const auto count = std::max<std::size_t>(1, rows.size() / 5);
  Held held{rows.back().co, 0.0, 0.0};
  for (std::size_t k = rows.size() - count; k < rows.size(); ++k) {
    held.stem += rows[k].stem / static_cast<double>(count);
    held.pv += rows[k].pv / static_cast<double>(count);
  }
  return held;
}

// Returns the outputs from `from` to `to` in equal steps of at most `most`, without the first.
std::vector<double> steps(double from, double to, double most) {
  const double count = std::ceil(std::abs(to - from) / most - 1e-6);
  std::vector<double> levels;
  for (double i = 1.0; i <= count; i += 1.0) levels.push_back(from + (to - from) * i / count);
  return levels;
}

double rms(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double v : values) squares += v * v / static_cast<double>(values.size());
  return std::sqrt(squares);
}

}  // namespace

Outcome stroke_valve(Setup& setup) {
  if (setup.elsewhere()) return Outcome::not_needed;
  Dialogue& dialogue = setup.dialogue;
  const config::LoopConfig loop = setup.loop();
  if (!agreed(setup,
              fmt::format("The loop is put in manual. The valve moves to the lower one of limits "
                          "that you give, up to the higher one, down again and back to its present "
                          "position, in steps of at most 1/{:g} of the way between them. Any key "
                          "ends it.",
                          kParts))) {
    return Outcome::left;
  }
  // All questions are asked before the loop is taken, because a session expires while the person
  // thinks.
  DaemonClient daemon(setup.socket);
  protocol::LoopStatus now = status_of(daemon, setup.tag);
  if (!now.cycle) throw TestAborted("the loop has not run yet");
  std::optional<double> stands;
  if (!std::isfinite(now.cycle->co)) {
    stands = dialogue.number_now(
        fmt::format(
            "  The output is not known, and your answer is written to it. Present position of the "
            "valve, {}",
            now.co_unit),
        now.co_unit);
  }
  protocol::LoopStatus believed = now;
  if (stands) believed.cycle->co = *stands;
  LiveLimits limits = limits_now(setup, believed);
  const double seconds = dialogue.number_now(
      "  Seconds at each step (five times what PV needs to follow the valve)", "s");
  if (!(seconds > 0.0 && seconds <= 600.0)) throw TestAborted("a step lasts up to 600 s");
  Session session(setup.socket, setup.tag);
  check_in_force(setup, daemon);
  if (stands) {
    session.set({.output = *stands});
    // The status shows the command a little later.
    for (int i = 0; i < 100 && !(now.cycle && std::isfinite(now.cycle->co)); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      now = status_of(daemon, setup.tag);
    }
  }
  AbortKey key(dialogue.person());
  session.guard(limits, key);
  std::vector<Held> up, down;
  {
    LiveBench bench(setup.socket, setup.tag, limits);
    const auto go = [&](double co) {
      const Held held = hold(bench, co, seconds);
      dialogue.say(fmt::format("  CO {:.4g} {}, valve {}, PV {:.5g} {}", held.co, loop.co_unit,
                               std::isfinite(held.stem) ? fmt::format("{:.4g}", held.stem) : "-",
                               held.pv, loop.pv_unit));
      return held;
    };
    const double low = limits.co_low;
    const double high = limits.co_high;
    const double step = (high - low) / kParts;
    const std::vector<double> there = steps(bench.output(), low, step);
    const std::vector<double> back = steps(low, bench.output(), step);
    dialogue.say(
        fmt::format("  Steps of at most {:.4g} {}: some {:.0f} s", step, loop.co_unit,
                    (static_cast<double>(there.size() + back.size()) + 2.0 * kParts) * seconds));
    // If the output is there already, it is held as well.
    up.push_back(go(there.empty() ? low : there.front()));
    for (std::size_t i = 1; i < there.size(); ++i) up.back() = go(there[i]);
    for (const double co : steps(low, high, step)) up.push_back(go(co));
    down.push_back(up.back());
    for (const double co : steps(high, low, step)) down.insert(down.begin(), go(co));
    for (const double co : back) go(co);
  }
  const double rise = up.back().pv - up.front().pv;
  const double pv_span = loop.pv.high - loop.pv.low;
  if (std::abs(rise) < 0.01 * pv_span) {
    throw TestAborted(
        fmt::format("PV moved by only {:.2g} {}. Check that the pump runs, that no hand valve is "
                    "shut, and that the limits are wide enough",
                    rise, loop.pv_unit));
  }
  const control::Action right = rise > 0.0 ? control::Action::reverse : control::Action::direct;
  setup.state().set_found("action", word_of(right));
  if (loop.controller.pid.action != right) {
    throw TestAborted(fmt::format(
        "PV {} with CO: controller.action must be {} in {}. {} asks once more",
        rise > 0.0 ? "rises" : "falls", word_of(right), loop.file, setup.command("file")));
  }
  std::string found =
      fmt::format("PV {} by {:.4g} {} over CO {:.4g} to {:.4g} {}", rise > 0.0 ? "rises" : "falls",
                  std::abs(rise), loop.pv_unit, limits.co_low, limits.co_high, loop.co_unit);
  if (std::isfinite(up.front().stem)) {
    std::vector<double> off, between;
    for (std::size_t i = 0; i < up.size(); ++i) {
      off.push_back(up[i].stem - up[i].co);
      off.push_back(down[i].stem - down[i].co);
      between.push_back(up[i].stem - down[i].stem);
    }
    const double span = loop.controller.output.high - loop.controller.output.low;
    const double percent = 100.0 * rms(off) / span;
    found += fmt::format(
        "; the valve is off CO by {:.2g} % of the limits' span, up and down differ "
        "by {:.2g} %",
        percent, 100.0 * rms(between) / span);
    constexpr double kMost_percent = 10.0;
    if (percent > kMost_percent) {
      throw TestAborted(found + ": check the scaling of command and read-back, and the valve");
    }
  }
  dialogue.say("  " + found);
  setup.state().set_found("stroke", found);
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
