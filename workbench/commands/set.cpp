// SPDX-License-Identifier: Apache-2.0
// loopwarden set: sends an operator's command to a running loop.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <optional>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "base/text.hpp"
#include "config/diagnostic.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct SetOptions {
  std::string socket;
  std::string loop;
  std::optional<double> set_point;
  std::optional<double> output;
  std::optional<std::string> mode;
  std::optional<std::string> jacket;
  bool json = false;
};

// Returns the mode in the daemon's spelling for either word in any case; empty if it is invalid.
std::string mode_word(const std::string& word) {
  const std::string lower = base::lower_case(word);
  if (lower == "auto" || lower == "automatic") return "auto";
  if (lower == "man" || lower == "manual") return "man";
  return {};
}

// Returns the error of the word; empty: the word is valid.
std::string no_mode(const std::string& word) {
  return mode_word(word).empty() ? "must be auto or man (got '" + config::quotable(word) + "')"
                                 : "";
}

protocol::LoopStatus loop_of(DaemonClient& daemon, const std::string& name) {
  const protocol::Status status = protocol::ask(daemon, protocol::StatusRequest{});
  return status.loops[loop_index(status.loops, name)];
}

std::string summary(const protocol::LoopStatus& loop) {
  const protocol::Cycle cycle = loop.cycle.value_or(protocol::Cycle{});
  const auto number = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string("-");
  };
  return fmt::format("mode {} (wanted {}), SP {} {}, CO {} {}, jacket {}{}", cycle.mode,
                     cycle.requested_mode, number(cycle.sp), loop.pv_unit, number(cycle.co),
                     loop.co_unit, cycle.jacket.form, cycle.jacket.acting ? " acting" : "");
}

std::uint64_t period_of(const protocol::LoopStatus& loop) {
  return loop.cycle ? loop.cycle->period : 0;
}

int run_set(const SetOptions& options) {
  if (!options.set_point && !options.output && !options.mode && !options.jacket) {
    require("one of --sp, --output, --mode, --jacket");
  }
  protocol::SetRequest request{.loop = options.loop};
  if (options.set_point) request.set_point = *options.set_point;
  if (options.output) request.output = *options.output;
  if (options.mode) request.mode = mode_word(*options.mode);
  if (options.jacket) request.jacket = *options.jacket;
  constexpr std::chrono::milliseconds kForDisk{1000};
  DaemonClient daemon(options.socket);
  const protocol::LoopStatus before = loop_of(daemon, options.loop);
  bool on_disk = true;
  try {
    on_disk = daemon.set(request, kForDisk);
  } catch (const DaemonRefused& e) {
    fail(kExitData, "loopwarden: {}: {}", options.loop, e.what());
  } catch (const OrderNotTaken& e) {
    fail(kExitTryAgain, "loopwarden: {}", e.what());
  }
  // The loop takes the command at its next cycle. The printed state must be newer than that.
  protocol::LoopStatus after = before;
  for (int i = 0; i < 100 && period_of(after) < period_of(before) + 2; ++i) {
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(before.sample_time_s, 0.1)));
    after = loop_of(daemon, options.loop);
  }
  if (options.json) {
    const nlohmann::json result = {
        {"loop", options.loop}, {"before", before}, {"after", after}, {"on_disk", on_disk}};
    show_json(result);
    return kExitOk;
  }
  fmt::print("{}: before: {}\n{:{}}  after:  {}\n", options.loop, summary(before), "",
             options.loop.size(), summary(after));
  if (!on_disk) fmt::print(stderr, "loopwarden: done, but the journal is not written yet\n");
  return kExitOk;
}

}  // namespace

void add_set(Program& program) {
  auto [command, o] = program.command(
      "set", "Set the set point, mode, output or jacket of a running loop", run_set);
  command.required("loop", o.loop, "tag of the loop");
  command.socket(o.socket);
  command.option("--sp", o.set_point, "set point, PV units");
  command.option("--output", o.output, "output in manual, CO units");
  command.option("--mode", o.mode, "auto (automatic) or man (manual)", checked(no_mode));
  command.option("--jacket", o.jacket, "off, shadow or on", one_of({"off", "shadow", "on"}));
  command.flag("--json", o.json, "print the result as JSON");
  command.footer(
      "The given values take effect together in one cycle, mode first. A command without effect "
      "is\nrejected with exit code 65: an output in automatic, a set point that tracks PV in "
      "manual,\na value outside its limits.\n"
      "Example: loopwarden set FIC-101 --mode man --output 30");
}

}  // namespace loopwarden::workbench
