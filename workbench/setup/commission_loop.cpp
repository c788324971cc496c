// SPDX-License-Identifier: Apache-2.0
// What `loopwarden commission` makes of the record, and the register map of `loopwarden register-map`: as a person would
// call them.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/exit_code.hpp"
#include "protocol/ask.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {
namespace {

namespace fs = std::filesystem;

// Where the daemon keeps what is the loop's.
fs::path state_directory(const Setup& setup) {
  DaemonClient daemon(setup.socket);
  return protocol::ask(daemon, protocol::DescribeRequest{}).state_directory;
}

// `file` with more lines at its end, where the daemon would read it so. Written whole, or not at all.
void add_lines(Setup& setup, const fs::path& file, const std::string& lines) {
  std::string text = text_of_file(file);
  text += (text.empty() || text.ends_with('\n') ? "" : "\n") + lines;
  if (!would_be_read(setup, {{file, text}})) {
    throw TestAborted(fmt::format("{} would not be read with these lines; nothing was written:\n{}",
                                  file.string(), lines));
  }
  write_output(file, text);
}

// The daemon reads its files again; what has to wait, and why it refuses them, is said by that command.
void reload(Setup& setup) {
  const int code = setup.run({"reload", "--socket", setup.socket}, {});
  if (code == kExitOk || code == kExitTryAgain) return;
  setup.dialogue.say(
      "  Its file has the lines, the daemon has not taken them: `loopwarden reload` once more when "
      "that is over.");
}

}  // namespace

Outcome commission(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  const std::string record = setup.state().found("record");
  if (record.empty()) {
    dialogue.say("  It needs the record, which was left.");
    return Outcome::left;
  }
  const fs::path out = state_directory(setup) / "commissioned" / setup.tag;
  fs::create_directories(out.parent_path());
  dialogue.say(fmt::format("  This takes minutes. Its result: {}", out.string()));
  std::vector<std::string> words{"commission", record, "--out", out.string(), "--plant", setup.tag};
  if (setup.record_minutes < 20.0) words.emplace_back("--accept-short");
  const int code = setup.run(words, {});
  if (code != 0) throw TestAborted(fmt::format("commission ended with exit code {}", code));
  const nlohmann::json result =
      nlohmann::json::parse(text_of_file(out / "commission.json"), nullptr, false);
  const std::string verdict = result.is_object() ? result.value("verdict", "") : "";
  if (verdict != "commissioned") {
    throw TestAborted(
        fmt::format("the verdict is {}; `loopwarden setup {} --again record` records "
                    "once more",
                    verdict, setup.tag));
  }
  std::string lines = "monitor:\n";
  if (result.value("specialists", nlohmann::json()).is_string()) {
    lines += fmt::format("  specialists: {}\n", (out / "specialists").string());
  }
  lines += fmt::format("  twin: {}\n", (out / "twin.yaml").string());
  if (("\n" + text_of_file(setup.loop_file())).find("\nmonitor:") == std::string::npos) {
    add_lines(setup, setup.loop_file(), lines);
    reload(setup);
  } else {
    dialogue.say(fmt::format("  {} has a section monitor already; these belong into it:\n{}",
                             setup.loop_file().string(), lines));
  }
  setup.state().set_found("commission", out.string());
  return Outcome::done;
}

Outcome connect_masters(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  if (dialogue.ask("masters") != "yes") return Outcome::not_needed;
  const fs::path file = setup.folder / "loopwardend.yaml";
  const auto read = config::read_configuration(setup.folder);
  if (read && !read->daemon.modbus_server) {
    add_lines(setup, file, "modbus_server: {}  # this host alone\n");
    dialogue.say("  The server begins with the daemon's next start.");
  }
  const fs::path map = setup.folder / "setup" / "register-map.csv";
  const int code =
      setup.run({"register-map", "--format", "csv", "--config", setup.folder.string()}, map);
  if (code != 0) throw TestAborted(fmt::format("register-map ended with exit code {}", code));
  dialogue.say(fmt::format("  {} has every address; `loopwarden register-map` knows other forms",
                           map.string()));
  setup.state().set_found("masters", map.string());
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
