// SPDX-License-Identifier: Apache-2.0
// loopwarden record: a CSV record of a running loop on demand.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "workbench/command_line/command_line.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"

namespace loopwarden::workbench {
namespace {

struct RecordOptions {
  std::string socket;
  std::string loop;
  std::string start;
  bool stop = false;
  bool json = false;
};

int run_record(const RecordOptions& options) {
  DaemonClient daemon(options.socket);
  loop_index(daemon.status(), options.loop);
  const std::string file = options.stop ? daemon.stop_record(options.loop)
                                        : daemon.start_record(options.loop, options.start);
  if (options.json) {
    const nlohmann::json result = {
        {"loop", options.loop},
        {"recording", !options.stop},
        {"file", file.empty() ? nlohmann::json(nullptr) : nlohmann::json(file)}};
    fmt::print("{}\n", result.dump(2));
  } else if (options.stop) {
    fmt::print("{}\n", file.empty() ? "no record was being written" : file);
  } else {
    fmt::print("recording to {}\n", file);
  }
  return kExitOk;
}

}  // namespace

void add_record(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* sub = app.add_subcommand("record", "start or stop a CSV record of a running loop");
  sub->add_option("loop", options->loop, "tag of the loop")->required();
  add_socket_option(*sub, options->socket);
  auto* start = sub->add_option("--start", options->start, "name of the record, without .csv");
  sub->add_flag("--stop", options->stop, "end the record")->excludes(start);
  add_json_flag(*sub, options->json);
  sub->footer("Example: loopwarden record FIC-101 --start after-repair");
  sub->callback([=, &exit_code] {
    if (start->empty() && !options->stop) throw CLI::RequiredError("--start or --stop");
    exit_code = run_record(*options);
  });
}

}  // namespace loopwarden::workbench
