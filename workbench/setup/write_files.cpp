// SPDX-License-Identifier: Apache-2.0
// The loop's file and its link, read by the reader of `check` before they are written.
#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "base/text.hpp"
#include "config/validation/validation.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/loop_text.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {
namespace {

namespace fs = std::filesystem;

// The link that reaches the same, by any name.
std::string known_link(const config::DaemonConfig& daemon, const std::string& link) {
  const std::string only = "links:\n  setup: " + link + "\n";
  const auto wanted = config::read_daemon_text("link", only);
  if (!wanted) throw TestAborted(std::string(base::trimmed(config::to_text(wanted.diagnostics))));
  for (const auto& [name, settings] : daemon.links) {
    hal::modbus::LinkSettings same = wanted->links.at("setup");
    same.name = settings.name;
    if (same == settings) return name;
  }
  return {};
}

std::string free_name(const config::DaemonConfig& daemon, const std::string& tag) {
  const std::string first = base::lower_case(tag);
  std::string name = first;
  for (int i = 2; daemon.links.contains(name); ++i) name = fmt::format("{}-{}", first, i);
  return name;
}

void ask_all(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  for (const char* id : {"pv.follows", "kc", "ti", "sp.limits", "co.limits", "co.rate"})
    dialogue.ask(id);
  dialogue.say("  What the output does when something fails, in " + dialogue.ask("co.unit") +
               " or hold:");
  for (const char* id : {"stop.end", "stop.bad_pv", "stop.output_lost"}) dialogue.ask(id);
}

}  // namespace

bool would_be_read(Setup& setup, const config::Drafts& drafts) {
  const auto read = config::validate_all(setup.folder, drafts);
  const std::string told = config::to_text(read.diagnostics);
  if (!told.empty()) setup.dialogue.say(std::string(base::trimmed(told)));
  return read.value.has_value();
}

Outcome write_files(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  if (setup.elsewhere() && dialogue.ask("source") == "opcua") return Outcome::not_needed;
  if (!setup.elsewhere()) ask_all(setup);
  const auto& answers = setup.state().answers();
  const Answered answered = [&](const char* id) -> std::string {
    const auto found = answers.find(id);
    return found == answers.end() ? "" : found->second;
  };
  const fs::path daemon_file = setup.folder / "loopwardend.yaml";
  std::string daemon_text = text_of_file(daemon_file);
  // It need not be there, but where it is it has to say something.
  const auto daemon = fs::exists(daemon_file)
                          ? config::read_daemon_text(daemon_file.string(), daemon_text)
                          : config::Loaded<config::DaemonConfig>{config::DaemonConfig{}, {}};
  if (!daemon) {
    throw CommandError(kExitConfiguration,
                       std::string(base::trimmed(config::to_text(daemon.diagnostics))));
  }
  const std::string link = link_text(answered);
  std::string name = known_link(*daemon, link);
  const bool new_link = name.empty();
  if (new_link) {
    name = free_name(*daemon, setup.tag);
    std::optional<std::string> with = with_link(daemon_text, name, link);
    if (!with) {
      throw TestAborted(fmt::format("{}: its links stand on one line; add there: {}: {}",
                                    daemon_file.string(), name, link));
    }
    daemon_text = std::move(*with);
  }
  const std::string loop = loop_text(answered, name);
  dialogue.say(fmt::format("{}:\n{}", setup.loop_file().string(), loop));
  if (new_link) dialogue.say(fmt::format("{}, links:\n  {}: {}", daemon_file.string(), name, link));
  config::Drafts drafts{{setup.loop_file(), loop}};
  if (new_link) drafts[daemon_file] = daemon_text;
  if (!would_be_read(setup, drafts)) {
    throw TestAborted(
        fmt::format("the files would not be read; nothing was written. `loopwarden "
                    "setup {} --again STEP` (loop, devices, file) asks anew",
                    setup.tag));
  }
  if (dialogue.ask("write") != "yes") {
    setup.state().forget("file");
    return Outcome::left;
  }
  OutputFiles files;
  files.make_folder(setup.folder / "loops.d");
  // The link before the loop that names it.
  if (new_link) files.add(daemon_file, daemon_text);
  files.add(setup.loop_file(), loop);
  files.commit();
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
