// SPDX-License-Identifier: Apache-2.0
// loopwarden top: shows a live view of a running daemon.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench {
namespace {

struct TopOptions {
  std::string loop;  // empty: no loop given
  std::string area;  // empty: all loops
  std::string socket;
  bool json = false;
  bool once = false;
};

// Returns the status with the loops of an area.
protocol::Status status_of(DaemonClient& daemon, const std::string& area) {
  protocol::Status status = protocol::ask(daemon, protocol::StatusRequest{});
  if (area.empty()) return status;
  std::erase_if(status.loops, [&](const protocol::LoopStatus& loop) {
    return !base::is_in_area(loop.area, area);
  });
  if (status.loops.empty()) fail(kExitData, "no loop is in the area {}", base::in_quotes(area));
  return status;
}

void print_once(const protocol::Status& status, const std::string& loop) {
  const std::size_t selected = loop.empty() ? status.loops.size() : loop_index(status.loops, loop);
  fmt::print("{}\n", daemon_line(status));
  if (const std::string line = writes_line(status.daemon); !line.empty()) fmt::print("{}\n", line);
  for (const std::string& line : disk_troubles(status.daemon)) {
    fmt::print("{}\n", coloured(line, Colour::red));
  }
  for (const std::string& line : connection_lines(status.daemon)) fmt::print("{}\n", line);
  for (const std::string& line : loop_table(status.loops, selected)) fmt::print("{}\n", line);
  if (loop.empty()) return;
  fmt::print("{}", place_line(status.loops, selected));
  for (const std::string& line : loop_details(status.loops[selected])) {
    fmt::print("{}\n", line);
  }
}

// `trouble`: why there is no status newer than `status`; empty while the daemon answers.
std::string page(const protocol::Status& status, std::size_t selected, const protocol::Trend& trend,
                 double window_s, const std::string& trouble) {
  const TerminalSize size = terminal_size();
  std::string text = trouble.empty()
                         ? coloured(daemon_line(status), Colour::bold)
                         : coloured(trouble + "; last values; trying again", Colour::red);
  text += "\n";
  const std::string writes = writes_line(status.daemon);
  if (!writes.empty()) text += writes + "\n";
  const std::vector<std::string> troubles = disk_troubles(status.daemon);
  for (const std::string& line : troubles) text += coloured(line, Colour::red) + "\n";
  const std::vector<std::string> connections = connection_lines(status.daemon);
  for (const std::string& line : connections) text += line + "\n";
  text += "\n";
  const std::vector<std::string> table = loop_table(status.loops, selected);
  // The table scrolls so that the selected loop stays visible in at most a third of the screen.
  const std::size_t most = std::max<std::size_t>(static_cast<std::size_t>(size.rows) / 3, 2);
  const std::size_t first = selected + 2 > most ? selected + 2 - most : 0;
  text += table.front() + "\n";
  std::size_t shown = 0;
  for (std::size_t i = first; i + 1 < table.size() && shown + 1 < most; ++i, ++shown) {
    text += table[i + 1] + "\n";
  }
  text += "\n";
  const protocol::LoopStatus& loop = status.loops.at(selected);
  const int used =
      static_cast<int>(shown + troubles.size() + connections.size()) + (writes.empty() ? 10 : 11);
  for (const std::string& line :
       trend_view(loop, trend, window_s, size.columns, size.rows - used)) {
    text += line + "\n";
  }
  text += coloured(place_line(status.loops, selected), Colour::grey);
  for (const std::string& line : loop_details(loop)) text += coloured(line, Colour::grey) + "\n";
  text += coloured("q quit   up/down select loop   +/- longer or shorter trend", Colour::grey);
  return text;
}

void watch(const std::string& socket, const std::string& first, const std::string& area) {
  auto daemon = std::make_unique<DaemonClient>(socket);
  protocol::Status status = status_of(*daemon, area);
  std::size_t selected = first.empty() ? 0 : loop_index(status.loops, first);
  watch_interrupts();
  Screen screen;
  double window_s = 60.0;
  std::optional<TrendBuffer> trend;
  while (!interrupted()) {
    std::string trouble;
    try {
      if (!daemon) {
        daemon = std::make_unique<DaemonClient>(socket);
        trend.reset();  // another run counts its periods from 0 again
      }
      status = status_of(*daemon, area);
      selected = std::min(selected, status.loops.size() - 1);
      const std::string& name = status.loops.at(selected).name;
      if (!trend || trend->loop() != name) trend.emplace(name);
      trend->update(*daemon);
    } catch (const std::exception& e) {
      daemon.reset();
      trouble = e.what();
      selected = std::min(selected, status.loops.size() - 1);
    }
    screen.show(
        page(status, selected, trend ? trend->rows() : protocol::Trend{}, window_s, trouble));
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
  const bool terminal = is_terminal(STDOUT_FILENO) && is_terminal(STDIN_FILENO);
  if (terminal && !options.once && !options.json) {
    use_colours(true);
    watch(options.socket, options.loop, options.area);
    return kExitOk;
  }
  DaemonClient daemon(options.socket);
  if (options.json) {
    show_answer(status_of(daemon, options.area));
  } else {
    use_colours(is_terminal(STDOUT_FILENO));
    print_once(status_of(daemon, options.area), options.loop);
  }
  return kExitOk;
}

}  // namespace

void add_top(Program& program) {
  auto [command, o] = program.command("top", "Show a live view of a running daemon", run_top);
  command.option("loop", o.loop,
                 "tag of the first loop; with --once, of the loop to print in detail");
  command.option("--area", o.area, "only the loops of this area and its parts, such as Unit 2");
  command.socket(o.socket);
  command.flag("--once", o.once, "print the state once, without the live view");
  command.flag("--json", o.json, "print the state once as JSON");
  command.footer("Example: loopwarden top --once FIC-101");
}

}  // namespace loopwarden::workbench
