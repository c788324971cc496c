// SPDX-License-Identifier: Apache-2.0
// loopwarden setup: takes a new loop to a commissioned one in steps that can be interrupted.
#include "workbench/setup/setup.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "daemon/protocol/ask.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/terminal.hpp"
#include "workbench/setup/probe_process.hpp"
#include "workbench/setup/questions.hpp"
#include "workbench/setup/terminal_person.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

struct SetupOptions {
  std::string tag;
  std::string config = setup::kDefaultFolder;
  std::string socket;
  std::string answers;
  std::string again;
  double minutes = 20.0;
  bool show = false;
  bool json = false;
};

int run_child(const std::vector<std::string>& words, const fs::path& output) {
  OutputFiles files;
  base::File file;
  if (!output.empty()) {
    file = base::File(files.stage(output), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (!file.is_open()) fail(kExitIo, "{}: can't be written", output.string());
  }
  try {
    base::ChildProcess child(fs::read_symlink("/proc/self/exe").string(), words,
                             {.output = file.is_open() ? file.fd() : STDOUT_FILENO,
                              .errors = STDERR_FILENO,
                              .idle = false});
    for (;;) {
      if (const std::optional<int> code = child.ended()) {
        if (*code == kExitOk) files.commit();
        return *code;
      }
      if (interrupted()) throw setup::Paused("paused");
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  } catch (const std::system_error& e) {
    fail(kExitIo, "loopwarden {}: {}", words.front(), e.code().message());
  }
}

// Used before the file for the answers exists.
std::string ask_tag(setup::Person& person, const setup::Answers& answers) {
  if (const auto written = answers.find("tag"); written != answers.end()) {
    return written->second.text;
  }
  const setup::Question& asked = setup::question("tag");
  for (;;) {
    const std::optional<std::string> tag = person.line(fmt::format("{}: ", asked.text));
    if (!tag) throw setup::Paused("paused");
    const std::string wrong = asked.wrong(*tag);
    if (wrong.empty()) return *tag;
    person.say("  " + wrong);
  }
}

int show(const setup::State& state, bool as_json) {
  nlohmann::json steps = nlohmann::json::array();
  for (const auto& [name, title] : protocol::kSetupSteps) {
    const std::string now = state.step(name).empty() ? "open" : state.step(name);
    const std::string found = state.found(name);
    steps.push_back({{"step", name}, {"state", now}, {"title", title}, {"found", found}});
    if (!as_json) {
      fmt::print("{:<12}{:<8}{}{}\n", name, now, title, found.empty() ? "" : ": " + found);
    }
  }
  if (as_json) show_json({{"steps", std::move(steps)}});
  return kExitOk;
}

int talk(const SetupOptions& options) {
  const setup::Answers answers =
      options.answers.empty() ? setup::Answers{} : setup::read_answers(options.answers);
  setup::TerminalPerson person;
  const std::string tag = options.tag.empty() ? ask_tag(person, answers) : options.tag;
  if (const std::string wrong = setup::question("tag").wrong(tag); !wrong.empty()) {
    fail(kExitUsage, "a tag is {} (got '{}')", wrong, tag);
  }
  setup::State state(fs::path(options.config) / "setup" / (tag + ".json"));
  if (options.show) return show(state, options.json);
  state.answer("tag", tag);
  if (!options.again.empty()) state.forget(options.again);
  setup::Dialogue dialogue(person, answers, state);
  setup::ProbeProcess prober(options.config);
  setup::Setup all{.dialogue = dialogue,
                   .prober = prober,
                   .run = run_child,
                   .folder = options.config,
                   .socket = options.socket,
                   .tag = tag,
                   .record_minutes = options.minutes};
  if (state.is_new()) dialogue.say("Enter `back` to return to the previous question.");
  const int exit_code = setup::run_steps(all);
  if (exit_code != kExitOk) {
    dialogue.say(fmt::format("\n{} continues with the remaining steps.", all.command()));
    return exit_code;
  }
  if (const std::string waits = setup::what_waits(all); !waits.empty()) {
    dialogue.say(
        fmt::format("\nAll steps are done. {}\nThen run {} once more.", waits, all.command()));
    return kExitTryAgain;
  }
  dialogue.say(all.elsewhere()
                   ? fmt::format("\n{} is set up, and watched.", tag)
                   : fmt::format("\n{} is set up and in manual: `loopwarden set {} --mode auto{}` "
                                 "closes the loop.",
                                 tag, tag, socket_option(options.socket)));
  return exit_code;
}

int run_setup(const SetupOptions& options) {
  try {
    return talk(options);
  } catch (const setup::Paused&) {
    fail(kExitTryAgain, "\nInterrupted. The same command continues at this step");
  } catch (const DaemonRefused& e) {
    fail(kExitTryAgain, "loopwarden: {}", e.what());
  } catch (const protocol::DaemonError& e) {
    fail(kExitTryAgain, "loopwarden: {}", e.what());
  }
}

}  // namespace

void add_setup(Program& program) {
  auto [command, o] = program.command(
      "setup", "Set up and commission a new loop, step by step, at a terminal", run_setup);
  command.option("tag", o.tag, "tag of the loop; setup asks for it if it is missing");
  command.setting("--config", o.config, "the daemon's configuration folder");
  command.socket(o.socket);
  command.option(
      "--answers", o.answers,
      "file of answers, YAML, one `question: answer` per line, for questions that move no valve");
  std::vector<std::string> steps;
  for (const auto& step : protocol::kSetupSteps) steps.emplace_back(step.name);
  command.option("--again", o.again, "step to repeat, with its questions", one_of(steps));
  command.setting("--minutes", o.minutes, "length of the record, min", between(1.0, 120.0));
  command.flag("--show", o.show, "print the progress, without questions");
  command.flag("--json", o.json, "print the progress as JSON, with --show");
  command.footer(
      "Answers are kept in DIR/setup/TAG.json; after an interruption, setup continues there.\n"
      "Every step that moves a valve asks each time for the tag and the limits. It refuses if the\n"
      "daemon does not run the file as it is. `back` returns to the previous question. Lines of a "
      "loop file that setup did not write\nstay, unless you agree. Exit code 75: steps remain, or "
      "a restart is needed.\n"
      "Example: loopwarden setup FIC-101");
}

}  // namespace loopwarden::workbench
