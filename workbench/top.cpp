// SPDX-License-Identifier: Apache-2.0
// loopwarden top: live view of a running daemon.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "workbench/daemon_client.hpp"
#include "workbench/loop_view.hpp"
#include "workbench/subcommands.hpp"
#include "workbench/terminal.hpp"

namespace loopwarden::workbench {
namespace {

struct TopOptions {
  std::string socket = DaemonClient::kDefaultSocket;
  bool json = false;
  bool once = false;
};

void print_once(const nlohmann::json& status) {
  fmt::print("{}\n", daemon_line(status));
  for (const std::string& line : loop_table(status, status.at("loops").size()))
    fmt::print("{}\n", line);
}

std::string details(const nlohmann::json& loop) {
  const auto& io = loop.at("io");
  const auto& recording = loop.at("recording");
  const auto age = [&](const char* key) {
    const auto found = loop.find(key);
    return found != loop.end() && found->is_number() ? fmt::format("{:.1f}", found->get<double>())
                                                     : std::string("-");
  };
  return fmt::format(
      "{}: {}   PV age {} ms   position age {} ms   recorded {} rows, {} lost, {:.1f} MB   bus: {} "
      "transactions, {} "
      "timeouts, "
      "{} exceptions, {} invalid, {} reconnects",
      loop.value("name", ""), loop.value("description", ""), age("pv_age_ms"),
      age("position_age_ms"), recording.at("rows").get<std::uint64_t>(),
      recording.at("dropped").get<std::uint64_t>() + recording.at("rows_lost").get<std::uint64_t>(),
      recording.at("bytes").get<double>() / 1e6, io.at("transactions").get<std::uint64_t>(),
      io.at("timeouts").get<std::uint64_t>(), io.at("device_exceptions").get<std::uint64_t>(),
      io.at("invalid_replies").get<std::uint64_t>(), io.at("reconnects").get<std::uint64_t>());
}

// What the monitor says of the loop's valve.
std::string valve_line(const nlohmann::json& loop) {
  const auto& m = loop.at("monitor");
  const double index = m.value("oscillation_index", 0.0);
  return fmt::format(
      "valve: {}   window {}: {}   variability {:.2f} %   {}   travel {:.0f} %/h   {:.0f} "
      "reversals/h   stick {:.1f} % ({})",
      loop.value("ne107", "-"), m.at("windows").get<std::uint64_t>(), m.value("window_state", ""),
      m.value("variability_percent", 0.0),
      index > 1.0 ? fmt::format("oscillates at {:.1f} s", m.value("oscillation_period_s", 0.0))
                  : std::string("does not oscillate"),
      m.value("travel_percent_per_hour", 0.0), m.value("reversals_per_hour", 0.0),
      m.value("stick_percent", 0.0), m.value("stick_source", ""));
}

// The condition indices, 100 good and 0 bad.
std::string condition_line(const nlohmann::json& loop) {
  const auto& condition = loop.at("monitor").at("condition");
  const auto index = [&](const char* key) {
    const auto& value = condition.at(key);
    return value.is_number() ? fmt::format("{:.0f}", value.get<double>()) : std::string("-");
  };
  return fmt::format(
      "condition (100 good, 0 bad, - not known): control performance {}   valve {}   actuator {}   "
      "positioner {}   environment {}",
      index("control_performance"), index("valve"), index("actuator"), index("positioner"),
      index("environment"));
}

std::string page(const nlohmann::json& status, std::size_t selected, const Trend& trend,
                 double window_s) {
  const TerminalSize size = terminal_size();
  std::string text = coloured(daemon_line(status), Colour::bold) + "\n\n";
  const std::vector<std::string> table = loop_table(status, selected);
  // The table scrolls so that the selected loop stays visible in at most a third of the screen.
  const std::size_t most = std::max<std::size_t>(static_cast<std::size_t>(size.rows) / 3, 2);
  const std::size_t first = selected + 2 > most ? selected + 2 - most : 0;
  text += table.front() + "\n";
  std::size_t shown = 0;
  for (std::size_t i = first; i + 1 < table.size() && shown + 1 < most; ++i, ++shown) {
    text += table[i + 1] + "\n";
  }
  text += "\n";
  const auto& loop = status.at("loops").at(selected);
  const int used = static_cast<int>(shown) + 9;
  for (const std::string& line :
       trend_view(loop, trend, window_s, size.columns, size.rows - used)) {
    text += line + "\n";
  }
  text += coloured(valve_line(loop), Colour::grey) + "\n";
  text += coloured(condition_line(loop), Colour::grey) + "\n";
  text += coloured(details(loop), Colour::grey) + "\n";
  text += coloured("q quit   up/down select loop   +/- longer or shorter trend", Colour::grey);
  return text;
}

void watch(DaemonClient& daemon) {
  watch_interrupts();
  Screen screen;
  std::size_t selected = 0;
  double window_s = 60.0;
  std::optional<TrendBuffer> trend;
  while (!interrupted()) {
    const nlohmann::json status = daemon.status();
    const auto& loops = status.at("loops");
    selected = std::min(selected, loops.size() - 1);
    const std::string name = loops[selected].at("name").get<std::string>();
    if (!trend || trend->loop() != name) trend.emplace(name);
    trend->update(daemon);
    screen.show(page(status, selected, trend->rows(), window_s));
    switch (screen.key(std::chrono::milliseconds(200)).value_or(' ')) {
      case 'q': return;
      case 'U':
      case 'k': selected -= selected > 0 ? 1 : 0; break;
      case 'D':
      case 'j': ++selected; break;
      case '+': window_s = std::min(window_s * 2.0, 1920.0); break;
      case '-': window_s = std::max(window_s / 2.0, 15.0); break;
      default: break;
    }
  }
}

int run_top(const TopOptions& options) {
  DaemonClient daemon(options.socket);
  if (options.json) {
    fmt::print("{}\n", daemon.status().dump(2));
  } else if (options.once || !is_terminal(STDOUT_FILENO) || !is_terminal(STDIN_FILENO)) {
    use_colours(is_terminal(STDOUT_FILENO));
    print_once(daemon.status());
  } else {
    use_colours(true);
    watch(daemon);
  }
  return kExitOk;
}

}  // namespace

void add_top(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<TopOptions>();
  CLI::App* sub = app.add_subcommand("top", "live view of a running daemon");
  sub->add_option("--socket", options->socket, "the daemon's control socket")
      ->capture_default_str();
  sub->add_flag("--once", options->once, "print the state once, without the live view");
  sub->add_flag("--json", options->json, "print the state once as JSON");
  sub->footer("Example: loopwarden top --socket /run/loopwardend/control.sock");
  sub->callback([options, &exit_code] { exit_code = run_top(*options); });
}

}  // namespace loopwarden::workbench
