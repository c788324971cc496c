// SPDX-License-Identifier: Apache-2.0
// loopwarden record: starts and stops a CSV record of a running loop.
#include <fmt/format.h>

#include <optional>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"

namespace loopwarden::workbench {
namespace {

struct RecordOptions {
  std::string socket;
  std::string loop;
  std::optional<std::string> start;
  bool stop = false;
  bool json = false;
};

int run_record(const RecordOptions& options) {
  if (!options.start && !options.stop) require("--start or --stop");
  DaemonClient daemon(options.socket);
  loop_index(protocol::ask(daemon, protocol::StatusRequest{}).loops, options.loop);
  protocol::RecordRequest request{.loop = options.loop};
  if (options.stop) {
    request.stop = true;
  } else {
    request.start = *options.start;
  }
  const std::string file = protocol::ask(daemon, request).file;
  if (options.json) {
    const nlohmann::json result = {
        {"loop", options.loop},
        {"recording", !options.stop},
        {"file", file.empty() ? nlohmann::json(nullptr) : nlohmann::json(file)}};
    show_json(result);
  } else if (options.stop) {
    fmt::print("{}\n", file.empty() ? "no record was being written" : file);
  } else {
    fmt::print("recording to {}\n", file);
  }
  return kExitOk;
}

}  // namespace

void add_record(Program& program) {
  auto [command, o] =
      program.command("record", "Start or stop a CSV record of a running loop", run_record);
  command.required("loop", o.loop, "tag of the loop");
  command.socket(o.socket);
  const Option start = command.option("--start", o.start, "name of the record, without .csv");
  command.flag("--stop", o.stop, "end the record").excludes(start);
  command.flag("--json", o.json, "print the result as JSON");
  command.footer("Example: loopwarden record FIC-101 --start after-repair");
}

}  // namespace loopwarden::workbench
