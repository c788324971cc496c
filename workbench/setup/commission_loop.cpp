// SPDX-License-Identifier: Apache-2.0
// Runs `loopwarden commission` on the record and writes the register map, with the same commands
// that a person would use.
#include <fmt/format.h>
#include <sys/stat.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/digest/digest.hpp"
#include "base/exit_code.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/files/output_files.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {
namespace {

namespace fs = std::filesystem;

// Returns the folder in which the daemon keeps the loop's data.
fs::path state_directory(const Setup& setup) {
  DaemonClient daemon(setup.socket);
  return protocol::ask(daemon, protocol::DescribeRequest{}).state_directory;
}

// Appends lines to `file` if the daemon would accept it. Writes the whole file or leaves it as it
// is.
void add_lines(Setup& setup, const fs::path& file, const std::string& lines) {
  std::string text = text_of_file(file);
  text += (text.empty() || text.ends_with('\n') ? "" : "\n") + lines;
  if (!would_be_read(setup, {{file, text}})) {
    throw TestAborted(fmt::format("{} would be invalid with these lines and was not changed:\n{}",
                                  file.string(), lines));
  }
  write_output(file, text);
}

// Makes the daemon read its files again. That command prints what must wait, and why files are
// refused.
void reload(Setup& setup) {
  const int code = setup.run({"reload", "--socket", setup.socket}, {});
  if (code == kExitOk || code == kExitTryAgain) return;
  setup.dialogue.say(
      "  The file has the new lines, the daemon does not use them yet. When the cause is over: " +
      setup.remedies().reload);
}

// Returns the time of the last change in UTC; 0: the file does not exist.
std::int64_t written_ms(const fs::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) return 0;
  return static_cast<std::int64_t>(info.st_mtim.tv_sec) * 1000 + info.st_mtim.tv_nsec / 1'000'000;
}

void add_range(std::vector<std::string>& words, const char* option, double low, double high) {
  words.insert(words.end(), {option, fmt::format("{}", low), fmt::format("{}", high)});
}

}  // namespace

Outcome commission(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  const std::string record = setup.state().found("record");
  if (record.empty()) {
    dialogue.say("  This step needs the record, which was skipped.");
    return Outcome::left;
  }
  const config::LoopConfig loop = setup.loop();
  const fs::path out = state_directory(setup) / "commissioned" / setup.tag;
  if (setup.state().found("commission") == out.string() &&
      loop.monitor.twin == (out / "twin.yaml").string()) {
    return Outcome::done;  // a person added the lines
  }
  fs::create_directories(out.parent_path());
  dialogue.say(fmt::format("  This takes minutes. Its result: {}", out.string()));
  const control::PidSettings& pid = loop.controller.pid;
  std::vector<std::string> words{"commission", record, "--out", out.string(), "--plant", setup.tag};
  add_range(words, "--pv-range", loop.pv.low, loop.pv.high);
  add_range(words, "--co-range", pid.output_low, pid.output_high);
  if (setup.record_minutes < 20.0) words.emplace_back("--accept-short");
  const int code = setup.run(words, {});
  if (code != 0) throw TestAborted(fmt::format("commission ended with exit code {}", code));
  const nlohmann::json result =
      nlohmann::json::parse(text_of_file(out / "commission.json"), nullptr, false);
  const std::string verdict = result.is_object() ? result.value("verdict", "") : "";
  if (verdict != "commissioned") {
    throw TestAborted(
        fmt::format("the verdict is {}; {} records once more", verdict, setup.command("record")));
  }
  std::string lines = "monitor:\n";
  if (result.value("specialists", nlohmann::json()).is_string()) {
    lines += fmt::format("  specialists: {}\n", (out / "specialists").string());
  }
  lines += fmt::format("  twin: {}\n", (out / "twin.yaml").string());
  setup.state().set_found("commission", out.string());
  if (loop.monitor.twin == (out / "twin.yaml").string()) {
    dialogue.say("  The loop's file names this twin already; the daemon takes it when it starts.");
    return Outcome::done;
  }
  if (("\n" + text_of_file(setup.loop_file())).find("\nmonitor:") != std::string::npos) {
    dialogue.say(fmt::format("  {} has a section monitor already; add these lines to it:\n{}",
                             setup.loop_file().string(), lines));
    return Outcome::left;
  }
  add_lines(setup, setup.loop_file(), lines);
  reload(setup);
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
  dialogue.say(
      fmt::format("  {} has every address; `loopwarden register-map{}` prints other "
                  "formats",
                  map.string(), setup.config_option()));
  setup.state().set_found("masters", map.string());
  return Outcome::done;
}

std::string what_waits(const Setup& setup) {
  try {
    const protocol::Remedies remedies = setup.remedies();
    DaemonClient daemon(setup.socket);
    const std::string text = text_of_file(setup.loop_file());
    if (std::string why = protocol::not_in_force(daemon, setup.tag, base::crc32(text), remedies);
        !why.empty()) {
      return why;
    }
    if (std::string why = protocol::box_not_in_force(daemon, remedies); !why.empty()) return why;
    const fs::path twin = setup.loop().monitor.twin;
    const std::int64_t started_ms = protocol::ask(daemon, protocol::DescribeRequest{}).started_ms;
    if (!twin.empty() && written_ms(twin) > started_ms) {
      return fmt::format("{}: {} is newer than the daemon's start. {}", setup.tag, twin.string(),
                         remedies.restart);
    }
    return {};
  } catch (const std::exception& e) {
    return e.what();
  }
}

}  // namespace loopwarden::workbench::setup
