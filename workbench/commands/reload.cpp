// SPDX-License-Identifier: Apache-2.0
// loopwarden reload: makes the running daemon read its files again, and prints the result per loop.
#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {
namespace {

constexpr std::chrono::seconds kPatience{10};   // with the daemon's disk
constexpr std::chrono::seconds kForJournal{1};  // to have the line on the disk

struct ReloadOptions {
  std::string socket;
  bool dry_run = false;
  bool take_file = false;
  bool json = false;
};

// Waits for the result of the reload. Returns the last state if the daemon does not finish in time.
protocol::ReloadState outcome_of(DaemonClient& daemon, std::uint64_t number) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  for (;;) {
    protocol::ReloadState now =
        protocol::ask(daemon, protocol::ReloadStateRequest{.reload = number});
    const bool done = now.outcome.has_value();
    if (done && (now.outcome->on_disk || Clock::now() - start > kForJournal)) return now;
    if (!done && Clock::now() - start > kPatience) return now;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void print(const protocol::ReloadOutcome& result, bool dry_run) {
  const bool refused = result.outcome == "refused";
  for (const protocol::Diagnostic& d :
       result.diagnostics.value_or(std::vector<protocol::Diagnostic>{})) {
    if (refused) break;  // they are the lines
    fmt::print(stderr, "{}:{}:{}: {}: {}{}\n", d.file, d.line, d.column, d.level,
               d.key.empty() ? "" : d.key + ": ", d.message);
  }
  for (const std::string& line : result.lines) {
    fmt::print(refused ? stderr : stdout, "{}\n", line);
  }
  if (result.take_file_needed) fmt::print(stderr, "loopwarden: {}\n", result.why.value_or(""));
  if (result.not_now) {
    fmt::print(stderr, "loopwarden: not now; {}\n",
               dry_run ? "nothing would change" : "nothing has changed yet");
  } else if (refused) {
    fmt::print(stderr, "loopwarden: the files {} refused; the configuration {}\n",
               dry_run ? "would be" : "were", dry_run ? "would stay" : "has not changed");
  } else if (result.outcome == "in_force") {
    fmt::print("everything in the files {} in force\n", dry_run ? "would be" : "is");
  } else {
    fmt::print("not everything in the files {} in force\n", dry_run ? "would be" : "is");
  }
}

int exit_code_of(const protocol::ReloadOutcome& result) {
  if (result.outcome == "in_force") return kExitOk;
  if (result.take_file_needed || result.not_now) return kExitData;
  return result.outcome == "refused" ? kExitConfiguration : kExitTryAgain;
}

int run_reload(const ReloadOptions& options) {
  DaemonClient daemon(options.socket);
  const std::uint64_t number =
      protocol::ask(daemon, protocol::ReloadRequest{.dry_run = options.dry_run,
                                                    .take_file = options.take_file})
          .reload;
  const protocol::ReloadState result = outcome_of(daemon, number);
  if (options.json) show_answer(result);
  if (!result.outcome) {
    fail(kExitTryAgain,
         "loopwarden: the daemon has not finished within {} s ({}); the loops run on as before, "
         "and its log will show the result",
         kPatience.count(), result.state);
  }
  if (!options.json) {
    print(*result.outcome, options.dry_run);
    if (!result.outcome->on_disk) {
      fmt::print(stderr, "loopwarden: done, but the journal is not written yet\n");
    }
  }
  return exit_code_of(*result.outcome);
}

}  // namespace

void add_reload(Program& program) {
  auto [command, o] =
      program.command("reload", "Make the running daemon read its configuration again", run_reload);
  command.socket(o.socket);
  command.flag("--dry-run", o.dry_run, "print the result that a reload would have");
  command.flag("--take-file", o.take_file,
               "take the files' gains even if a person has set others, which no file has");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer(
      "Each loop takes all that can be applied. A loop whose unit, range, sample time or io\n"
      "differs is not changed. A reload does not move the valve.\n"
      "Exit code 0: everything in the files is in force;\n"
      "75: something waits for a restart, or for CO to be inside new limits; 78: the files have\n"
      "errors and were refused; 65: the files would change gains that a person has set and no\n"
      "file has, so they were refused without --take-file; or a loop is being commissioned, and "
      "the\n"
      "daemon reads the files when that has ended.\n"
      "Example: loopwarden reload --dry-run");
}

}  // namespace loopwarden::workbench
