// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/setup.hpp"

#include <fmt/format.h>

#include "base/file.hpp"
#include "base/text.hpp"
#include "config/config_reader.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/planned_files.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {

config::LoopConfig Setup::loop() const {
  auto read = config::read_loop_file(loop_file());
  if (!read) {
    throw CommandError(kExitConfiguration,
                       std::string(base::trimmed(config::to_text(read.diagnostics))));
  }
  return std::move(*read);
}

std::string Setup::config_option() const {
  return folder == kDefaultFolder ? "" : " --config " + base::as_shell_word(folder.string());
}

std::string Setup::command(const std::string& again) const {
  return fmt::format("`loopwarden setup {}{}{}{}`", tag, config_option(), socket_option(socket),
                     again.empty() ? "" : " --again " + again);
}

protocol::Remedies Setup::remedies() const {
  protocol::Remedies all{.reload =
                             fmt::format("Run `loopwarden reload{}`.", socket_option(socket))};
  if (const std::string config = config_option(); !config.empty()) {
    all.restart = fmt::format(
        "Stop the daemon and start it again (`loopwardend{}`). Until it runs again, every loop is "
        "in its stop action.",
        config);
  }
  return all;
}

std::string text_of_file(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return {};
  std::optional<std::string> text = base::read_file(file);
  if (!text) throw CommandError(kExitIo, file.string() + ": can't be read");
  return std::move(*text);
}

Outcome name_loop(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  // The tags of a server already answer these questions.
  if (setup.elsewhere() && dialogue.ask("source") == "opcua") return Outcome::done;
  for (const char* id :
       {"description", "pv.unit", "pv.range", "co.unit", "co.range", "sample_time"})
    dialogue.ask(id);
  return Outcome::done;
}

int run_steps(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  dialogue.check_by([&setup](const std::string& id, const std::string& answer) {
    return why_refused(setup, id, answer);
  });
  int exit_code = kExitOk;
  // A loop that already has a file is commissioned without changes.
  if (setup.state().is_new() && std::filesystem::exists(setup.loop_file())) {
    const config::LoopConfig loop = setup.loop();
    dialogue.say(fmt::format("{} exists; the setup uses it as it is", loop.file));
    setup.state().answer("control", config::is_watched(loop.io) ? "elsewhere" : "here");
    for (const char* step : {"loop", "devices", "file"}) setup.state().set_step(step, "done");
  }
  for (std::size_t i = 0; i < kSteps.size(); ++i) {
    const auto [name, title] = protocol::kSetupSteps[i];
    if (setup.state().step(name) == "done") continue;
    dialogue.say(fmt::format("\nStep {} of {}, {}: {}", i + 1, kSteps.size(), name, title));
    setup.state().begin_step(name);
    try {
      const Outcome outcome = kSteps[i](setup);
      if (outcome == Outcome::left) exit_code = kExitTryAgain;
      setup.state().set_step(name, outcome == Outcome::left ? "left" : "done");
      if (outcome == Outcome::not_needed) dialogue.say("  Nothing to do here.");
      if (outcome == Outcome::left) dialogue.say("  Skipped. Setup offers it again next time.");
    } catch (const Back& back) {
      const std::string_view wanted = question(back.question).step;
      while (i > 0 && protocol::kSetupSteps[i].name != wanted) --i;
      setup.state().set_step(protocol::kSetupSteps[i].name, "");
      --i;
    } catch (const TestAborted& e) {
      dialogue.say(
          fmt::format("  Ended: {}\n  {} begins this step again.", e.what(), setup.command()));
      return kExitTryAgain;
    }
  }
  return exit_code;
}

}  // namespace loopwarden::workbench::setup
