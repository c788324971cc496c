// SPDX-License-Identifier: Apache-2.0
// Common behaviour of all commands: exit codes, standard streams, written files, unknown words.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::command_line_test {
namespace {

namespace fs = std::filesystem;

const std::string kProgram = LOOPWARDEN_BIN_DIR "/loopwarden";
const std::string kModel = LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml";
const std::string kHealthyModel = LOOPWARDEN_SOURCE_DIR "/examples/models/plant1-believed.yaml";
const std::string kRecord = LOOPWARDEN_SOURCE_DIR "/examples/routine/r22.csv";

ShellOutcome loopwarden(const std::string& arguments) {
  return bash(kProgram + " " + arguments + " 2>&1");
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  return names;
}

// A record of a step from rest, for identify.
std::string step_record() {
  std::string text = "time,pv,co\n";
  double pv = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double co = k < 50 ? 30.0 : 40.0;
    text += std::to_string(k) + "," + std::to_string(pv) + "," + std::to_string(co) + "\n";
    pv += 0.2 * (0.5 * (co - 30.0) - pv);
  }
  return text;
}

// The shortest call of every command that prints a result without a daemon.
std::vector<std::string> printing_commands(const TemporaryFolder& folder) {
  const std::string step = (folder / "step.csv").string();
  write_file(step, step_record());
  return {"check " + kModel,
          "simulate " + kModel + " --duration 10 --out " + (folder / "run.csv").string(),
          "identify " + step,
          "tune " + kModel,
          "limit-cycle " + kModel + " --s 1 --j 0.4",
          "autotune " + kHealthyModel,
          "valve-test " + kModel + " --test step_change",
          "diagnose " + kRecord,
          "effects",
          "register-map"};
}

TEST_CASE("a full or closed standard output is an error of every command") {
  const TemporaryFolder folder;
  std::vector<std::string> commands = printing_commands(folder);
  commands.insert(commands.end(),
                  {"--help", "--version", "help gap", "gap --help", "register-map --format csv"});
  for (const std::string& command : commands) {
    INFO(command);
    const ShellOutcome full = bash(kProgram + " " + command + " 2>&1 >/dev/full");
    CHECK(full.exit_code == 74);
    CHECK(full.text.find("standard output: No space left on device") != std::string::npos);
    CHECK(bash(kProgram + " " + command + " 2>/dev/null >&-").exit_code == 74);
  }
  CHECK(bash(std::string(LOOPWARDEN_BIN_DIR) + "/loopwardend --help 2>/dev/null >/dev/full")
            .exit_code == 74);
}

TEST_CASE("a closed standard output is not mistaken for a file of the command") {
  const TemporaryFolder folder;
  const std::string out = (folder / "run.csv").string();
  const std::string simulate = kProgram + " simulate " + kModel + " --duration 1 --out " + out;
  REQUIRE(bash(simulate).exit_code == 0);
  const std::string good = read_file(out);
  bash(simulate + " >&- 2>&-");
  CHECK(read_file(out) == good);
}

TEST_CASE("a reader that leaves early, and an error output that is full, are no errors") {
  CHECK(bash(kProgram + " effects --json | head -1 >/dev/null; exit ${PIPESTATUS[0]}").exit_code ==
        0);
  CHECK(
      bash(kProgram + " register-map --format pymodbus | true; exit ${PIPESTATUS[0]}").exit_code ==
      0);
  CHECK(bash(kProgram + " dance 2>/dev/full").exit_code == 64);
}

TEST_CASE("--json prints exactly one JSON value") {
  const TemporaryFolder folder;
  for (const std::string& command : printing_commands(folder)) {
    INFO(command);
    const ShellOutcome outcome = bash(kProgram + " " + command + " --json 2>/dev/null");
    CHECK(outcome.exit_code == 0);
    const nlohmann::json value = nlohmann::json::parse(outcome.text, nullptr, false);
    CHECK((value.is_object() || value.is_array()));
  }
}

TEST_CASE("every command that prints a result has --json") {
  for (const char* command :
       {"check",        "simulate", "top",      "set",      "record",   "alarms",
        "register-map", "export",   "diagnose", "train",    "classify", "replay",
        "gap",          "demo",     "effects",  "identify", "compare",  "limit-cycle",
        "valve-test",   "autotune", "tune",     "outcome",  "receipt",  "setup"}) {
    INFO(command);
    CHECK(loopwarden(std::string(command) + " --help").text.find("--json") != std::string::npos);
  }
}

TEST_CASE("an output that is also an input is refused under any name, and the input is kept") {
  const TemporaryFolder folder;
  write_file(folder / "model.yaml", read_file(kModel));
  write_file(folder / "step.csv", step_record());
  fs::create_directories(folder / "results");
  const std::string at = folder.path().string();
  for (const std::string input : {"model.yaml", "step.csv"}) {
    fs::create_hard_link(folder / input, folder / ("hard-" + input));
    fs::create_symlink(folder / input, folder / ("soft-" + input));
  }
  struct Row {
    const char* command;
    const char* input;
  };
  for (const Row& row : {Row{"simulate", "model.yaml"}, Row{"tune", "model.yaml"},
                         Row{"limit-cycle --s 1", "model.yaml"}, Row{"identify", "step.csv"}}) {
    const std::string before = read_file(folder / row.input);
    for (const std::string& out : {at + "/" + row.input, at + "/./results/../" + row.input,
                                   at + "/hard-" + row.input, at + "/soft-" + row.input}) {
      INFO(row.command << " " << out);
      const ShellOutcome outcome =
          loopwarden(std::string(row.command) + " " + at + "/" + row.input + " --out " + out);
      CHECK(outcome.exit_code == 64);
      CHECK(outcome.text.find("is the input") != std::string::npos);
      CHECK(read_file(folder / row.input) == before);
    }
  }
  // The input has the name of a file in the folder of results.
  fs::rename(folder / "step.csv", folder / "results/report.html");
  CHECK(loopwarden("gap " + at + "/results/report.html --model " + at + "/model.yaml --out " + at +
                   "/results")
            .exit_code == 64);
  CHECK(read_file(folder / "results/report.html") == step_record());
}

TEST_CASE("on a full disk a command removes its files and gives the reason") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out");
  for (const std::string& command :
       {"simulate " + kModel + " --duration 2000 --out " + (folder / "out/run.csv").string(),
        "tune " + kModel + " --out " + (folder / "out/tune.html").string(),
        "effects --out " + (folder / "out").string()}) {
    INFO(command);
    const ShellOutcome outcome =
        bash("ulimit -f 1; " + kProgram + " " + command + " 2>&1 >/dev/null");
    CHECK(outcome.exit_code == 74);
    CHECK(outcome.text.find("can't be written: File too large") != std::string::npos);
    CHECK(outcome.text.find(".tmp") == std::string::npos);
    CHECK(names_in(folder / "out").empty());
  }
}

TEST_CASE("existing files stay until all new files are complete") {
  const TemporaryFolder folder;
  const std::string out = (folder / "effects.md").string();
  write_file(out, "mine");
  // The last of many files does not fit; the files before it did.
  CHECK(bash("ulimit -f 8; " + kProgram + " effects --out " + folder.path().string() +
             " >/dev/null 2>&1")
            .exit_code == 74);
  CHECK(read_file(out) == "mine");
  CHECK(names_in(folder.path()) == std::vector<std::string>{"effects.md"});
}

TEST_CASE("links and permissions of replaced files stay") {
  const TemporaryFolder folder;
  const std::string page = (folder / "tune.html").string();
  write_file(page, "earlier");
  fs::permissions(page, fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("tune.html", folder / "link.html");
  REQUIRE(loopwarden("tune " + kModel + " --out " + (folder / "link.html").string()).exit_code ==
          0);
  CHECK(fs::is_symlink(folder / "link.html"));
  CHECK(read_file(page).find("<html") != std::string::npos);
  CHECK(fs::status(page).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
  // A device or pipe is written directly.
  const ShellOutcome piped = bash(kProgram + " tune " + kModel + " --out /dev/stdout | cat");
  CHECK(piped.text.find("<html") != std::string::npos);
  CHECK(piped.text.find("simc") != std::string::npos);
}

// Starts the command, waits for `begun`, and interrupts the command.
template <class Begun>
int interrupted(const std::vector<std::string>& arguments, int signal, Begun begun) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(null, STDERR_FILENO);
    std::vector<char*> argv;
    std::string program = kProgram;
    argv.push_back(program.data());
    std::vector<std::string> words = arguments;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  int status = 0;
  while (!begun() && ::waitpid(child, &status, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ::kill(child, signal);
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

TEST_CASE("Ctrl-C and SIGTERM remove temporary files and new folders") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out");
  const int signal = GENERATE(SIGINT, SIGTERM);
  const std::string run = (folder / "out/run.csv").string();
  CHECK(interrupted({"simulate", kModel, "--duration", "100000000", "--out", run}, signal,
                    [&] { return !names_in(folder / "out").empty(); }) == -signal);
  CHECK(names_in(folder / "out").empty());
}

TEST_CASE("an unknown command or option is reported, with the nearest valid one") {
  struct Row {
    const char* words;
    const char* says;
  };
  for (const Row& row : {Row{"gapp record.csv", "unknown command .gapp.; did you mean .gap.?"},
                         Row{"gap r.csv --modell m.yaml --out x",
                             "unknown option .--modell. of gap; did you mean .--model.?"},
                         Row{"alarms shelve FIC-1 stiction --minute 5",
                             "unknown option .--minute. of shelve; did you mean .--minutes.?"},
                         Row{"alarms ack FIC-1 sticktion", "did you mean .stiction.?"},
                         Row{"--versoin", "unknown option .--versoin.; did you mean .--version.?"},
                         Row{"tune -x m.yaml", "unknown option .-x. of tune"}}) {
    INFO(row.words);
    const ShellOutcome outcome = loopwarden(row.words);
    CHECK(outcome.exit_code == 64);
    CHECK_THAT(outcome.text, Catch::Matches("(.|\n)*" + std::string(row.says) + "(.|\n)*"));
  }
  // Values are not mistaken for options.
  CHECK(loopwarden("diagnose " + kRecord + " --co-range -5 105").exit_code == 0);
}

TEST_CASE("help and version accept the usual words") {
  CHECK(loopwarden("version").text == loopwarden("--version").text);
  CHECK(loopwarden("-V").text == loopwarden("--version").text);
  CHECK(loopwarden("help gap").text == loopwarden("gap --help").text);
  CHECK(loopwarden("help alarms shelve").text == loopwarden("alarms shelve --help").text);
  CHECK(loopwarden("help").text == loopwarden("--help").text);
  CHECK(loopwarden("help gapp").exit_code == 64);
  CHECK(loopwarden("help gap").exit_code == 0);
}

TEST_CASE("negative counts and seeds are refused") {
  for (const char* command : {"simulate m --out x", "train m --out x"}) {
    INFO(command);
    const ShellOutcome outcome = loopwarden(std::string(command) + " --seed -1");
    CHECK(outcome.exit_code == 64);
    CHECK(outcome.text.find("must not be negative (got -1)") != std::string::npos);
  }
  CHECK(loopwarden("gap r --model m --out x --jobs -1").exit_code == 64);
}

TEST_CASE("the daemon's socket is given by LOOPWARDEN_SOCKET, or is that of the package") {
  CHECK(bash("LOOPWARDEN_SOCKET=/nonexistent/mine.sock " + kProgram + " top --once 2>&1")
            .text.find("/nonexistent/mine.sock") != std::string::npos);
  CHECK(bash("LOOPWARDEN_SOCKET=/nonexistent/mine.sock " + kProgram +
             " top --once --socket /nonexistent/other.sock 2>&1")
            .text.find("/nonexistent/other.sock") != std::string::npos);
  const std::string unit = read_file(LOOPWARDEN_SOURCE_DIR "/systemd/loopwardend.service");
  CHECK(unit.find("RuntimeDirectory=loopwardend\n") != std::string::npos);
  CHECK(loopwarden("top --help").text.find("/run/loopwardend/control.sock") != std::string::npos);
}

TEST_CASE("a record can be read from standard input") {
  const ShellOutcome piped = bash(kProgram + " diagnose - --json < " + kRecord);
  const ShellOutcome named = bash(kProgram + " diagnose " + kRecord + " --json");
  CHECK(piped.exit_code == 0);
  CHECK(nlohmann::json::parse(piped.text).at("verdict") ==
        nlohmann::json::parse(named.text).at("verdict"));
  const ShellOutcome bad = bash("echo time,pv | " + kProgram + " diagnose - 2>&1");
  CHECK(bad.exit_code == 65);
  CHECK(bad.text.find("standard input") != std::string::npos);
}

TEST_CASE("train writes over its own folder only") {
  const TemporaryFolder folder;
  write_file(folder / "manifest.yaml", "name: a site of mine\n");
  const ShellOutcome foreign =
      loopwarden("train " + kModel + " --windows 700 --restarts 1 --out " + folder.path().string());
  CHECK(foreign.exit_code == 64);
  CHECK(foreign.text.find("manifest.yaml: not written by loopwarden train") != std::string::npos);
  CHECK(read_file(folder / "manifest.yaml") == "name: a site of mine\n");
}

TEST_CASE("train continues with the windows of an interrupted run") {
  const TemporaryFolder folder;
  const auto words = [&](const char* out) {
    return std::vector<std::string>{
        "train", kHealthyModel, "--windows", "700",   "--restarts",
        "1",     "--jobs",      "1",         "--out", (folder / out).string()};
  };
  const auto line = [&](const char* out) {
    std::string text;
    for (const std::string& word : words(out)) text += word + " ";
    return text;
  };
  CHECK(interrupted(words("cut"), SIGINT, [&] {
          return fs::exists(folder / "cut/unfinished/windows-0.json");
        }) == -SIGINT);
  const ShellOutcome again = loopwarden(line("cut"));
  CHECK(again.exit_code == 0);
  CHECK(again.text.find("windows were there from an interrupted run") != std::string::npos);
  CHECK_FALSE(fs::exists(folder / "cut/unfinished"));
  REQUIRE(loopwarden(line("whole")).exit_code == 0);
  CHECK(read_file(folder / "cut/manifest.yaml") == read_file(folder / "whole/manifest.yaml"));
}

}  // namespace
}  // namespace loopwarden::tests::command_line_test
