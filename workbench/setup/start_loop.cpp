// SPDX-License-Identifier: Apache-2.0
// Starts the new loop. The daemon takes a new loop only at its start, and a changed file by a
// reload. The person compares the daemon's values with the plant before any move.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "base/digest/digest.hpp"
#include "daemon/protocol/ask.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "workbench/setup/moving.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {
namespace {

// Returns why the daemon does not run the loop as its file is; empty: it does.
std::string not_running(const Setup& setup) {
  try {
    DaemonClient daemon(setup.socket);
    return protocol::not_in_force(daemon, setup.tag, base::crc32(text_of_file(setup.loop_file())),
                                  setup.remedies());
  } catch (const std::exception& e) {
    const std::string config = setup.config_option();
    return fmt::format(
        "{}. Start the daemon (`{}`).", e.what(),
        config.empty() ? "systemctl enable --now loopwardend" : "loopwardend" + config);
  }
}

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.5g}", value) : std::string("-");
}

}  // namespace

Outcome start_loop(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  for (std::string why; !(why = not_running(setup)).empty();) {
    dialogue.say(fmt::format("  {}\n  Do this in another terminal.", why));
    dialogue.ask_now("  Enter when it is done");
    for (int i = 0; i < 100 && !not_running(setup).empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  DaemonClient daemon(setup.socket);
  constexpr int kLines = 5;
  protocol::LoopStatus now;
  protocol::Cycle cycle;
  for (int i = 0; i < kLines; ++i) {
    now = status_of(daemon, setup.tag);
    cycle = now.cycle.value_or(protocol::Cycle{});
    dialogue.say(fmt::format("  PV {} {} ({}), valve {} {}, CO {}, mode {}, fault {}",
                             number(cycle.pv), now.pv_unit, cycle.pv_quality, number(cycle.stem),
                             now.co_unit, number(cycle.co), cycle.mode, cycle.fault));
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
  }
  if (cycle.pv_quality != "good") {
    throw TestAborted(fmt::format("PV is {}: {}", cycle.pv_quality, cycle.pv_reason));
  }
  if (!dialogue.yes_now("  Do these agree with what the devices and the plant show")) {
    throw TestAborted(
        fmt::format("register, type or scaling is wrong. Correct {} and restart the daemon",
                    setup.loop_file().string()));
  }
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
