// SPDX-License-Identifier: Apache-2.0
// loopwarden batch: runs many command lines, each once.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <list>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/command_line/share.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/output_files.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

struct BatchCommand {
  std::string jobs_file;
  std::string out;
  std::string shard;
  unsigned jobs = 1;
  bool retry = false;
  bool json = false;
};

struct Job {
  std::size_t line = 0;
  std::string text;
  std::vector<std::string> words;
  fs::path log;     // its output; locked while it runs, by whoever started it
  fs::path result;  // once it has ended
};

struct Ended {
  int exit_code = 0;
  double seconds = 0.0;
};

constexpr std::chrono::milliseconds kLookEvery{20};

// Splits a line at spaces as a shell does, with quotes but without substitutions.
std::vector<std::string> words_of(const std::string& text, const std::string& place) {
  std::vector<std::string> words;
  std::string word;
  bool within = false;
  char quote = '\0';
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (quote != '\0') {
      if (c == quote) {
        quote = '\0';
      } else {
        word += c;
      }
      continue;
    }
    if (c == '\'' || c == '"') {
      quote = c;
      within = true;
    } else if (c == ' ' || c == '\t') {
      if (within) words.push_back(std::exchange(word, {}));
      within = false;
    } else {
      word += c;
      within = true;
    }
  }
  if (quote != '\0') fail(kExitData, "{}: no closing quote", place);
  if (within) words.push_back(word);
  return words;
}

std::vector<Job> read_jobs(const std::string& path, const fs::path& out) {
  std::ifstream in(path);
  if (!in) {
    fail(kExitIo, "{}: can't be opened: {}", path, base::error_text(errno));
  }
  std::vector<Job> jobs;
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    if (text.ends_with('\r')) text.pop_back();
    const std::size_t first = text.find_first_not_of(" \t");
    if (first == std::string::npos || text[first] == '#') continue;
    const std::string place = fmt::format("{}:{}", path, line);
    Job job{.line = line,
            .text = text.substr(first),
            .words = words_of(text, place),
            .log = {},
            .result = {}};
    if (job.words.front() == "loopwarden") job.words.erase(job.words.begin());
    if (job.words.empty() || job.words.front() == "batch") {
      fail(kExitData, "{}: each row must be one loopwarden command other than batch", place);
    }
    const std::string name = fmt::format("{:016x}", stable_hash(job.text));
    job.log = out / (name + ".log");
    job.result = out / (name + ".json");
    for (const Job& other : jobs) {
      if (other.log == job.log) {
        fail(kExitData, "{}: the same as line {}", place, other.line);
      }
    }
    jobs.push_back(std::move(job));
  }
  if (jobs.empty()) fail(kExitData, "{}: no command in it", path);
  return jobs;
}

std::optional<Ended> ended_before(const Job& job) {
  std::ifstream in(job.result);
  if (!in) return std::nullopt;
  const nlohmann::json result = nlohmann::json::parse(in, nullptr, false);
  if (!result.is_object() || !result.contains("exit_code")) return std::nullopt;
  return Ended{result["exit_code"].get<int>(), result.value("seconds", 0.0)};
}

struct Running {
  const Job* job;
  std::unique_ptr<base::ChildProcess> child;
  std::chrono::steady_clock::time_point since;
};

// Returns nullopt while another batch is running this job.
std::optional<Running> start(const Job& job) {
  const base::File log(job.log, O_WRONLY | O_CREAT, 0644);
  if (!log.is_open()) {
    fail(kExitIo, "{}: can't be written: {}", job.log.string(), base::error_text(errno));
  }
  // The child holds the lock with its output, even after this batch is killed.
  if (::flock(log.fd(), LOCK_EX | LOCK_NB) != 0) return std::nullopt;
  if (::ftruncate(log.fd(), 0) != 0) {
    fail(kExitIo, "{}: can't be written", job.log.string());
  }
  return Running{
      &job,
      std::make_unique<base::ChildProcess>("/proc/self/exe", job.words,
                                           base::ChildSettings{.output = log.fd(), .idle = false}),
      std::chrono::steady_clock::now()};
}

void keep(const Job& job, const Ended& ended) {
  write_output(job.result, nlohmann::json{{"command", job.text},
                                          {"exit_code", ended.exit_code},
                                          {"seconds", ended.seconds}}
                                   .dump() +
                               "\n");
}

int run_batch(const BatchCommand& options) {
  const fs::path out =
      options.out.empty() ? fs::path(options.jobs_file + ".results") : fs::path(options.out);
  const Share share = share_from(options.shard);
  std::vector<Job> jobs = read_jobs(options.jobs_file, out);
  std::erase_if(jobs, [&](const Job& job) { return !share.has(job.text); });
  OutputFiles folder;
  folder.make_folder(out);
  folder.commit();
  std::list<const Job*> waiting;
  std::size_t before = 0;
  for (const Job& job : jobs) {
    const std::optional<Ended> ended = ended_before(job);
    if (ended && (ended->exit_code == 0 || !options.retry)) {
      ++before;
    } else {
      waiting.push_back(&job);
    }
  }
  if (before > 0) fmt::print(stderr, "{} of {} ended before\n", before, jobs.size());
  Progress progress("batch", waiting.size());
  const std::size_t all = waiting.size();
  std::list<Running> running;
  while (!waiting.empty() || !running.empty()) {
    for (auto at = waiting.begin(); at != waiting.end() && running.size() < options.jobs;) {
      // Another batch may have finished it meanwhile.
      const std::optional<Ended> ended = ended_before(**at);
      if (ended && (ended->exit_code == 0 || !options.retry)) {
        at = waiting.erase(at);
      } else if (auto started = start(**at)) {
        running.push_back(std::move(*started));
        at = waiting.erase(at);
      } else {
        ++at;
      }
    }
    for (auto at = running.begin(); at != running.end();) {
      const std::optional<int> code = at->child->ended();
      if (!code) {
        ++at;
        continue;
      }
      keep(*at->job,
           {*code,
            std::chrono::duration<double>(std::chrono::steady_clock::now() - at->since).count()});
      at = running.erase(at);
    }
    progress.update(all - waiting.size() - running.size());
    std::this_thread::sleep_for(kLookEvery);
  }
  std::size_t failed = 0;
  nlohmann::json list = nlohmann::json::array();
  for (const Job& job : jobs) {
    const std::optional<Ended> ended = ended_before(job);
    const int code = ended ? ended->exit_code : -1;
    if (code != 0) ++failed;
    list.push_back({{"line", job.line},
                    {"command", job.text},
                    {"exit_code", code},
                    {"log", job.log.string()}});
    if (!options.json && code != 0) {
      fmt::print("{}:{}: exit code {}: {}\n  {}\n", options.jobs_file, job.line, code, job.text,
                 job.log.string());
    }
  }
  if (options.json) {
    show_json(list);
  } else {
    fmt::print("{} commands, {} of them failed; {}\n", jobs.size(), failed, out.string());
  }
  return failed == 0 ? kExitOk : kExitData;
}

}  // namespace

void add_batch(Program& program) {
  auto [command, o] = program.command(
      "batch",
      "Run many loopwarden command lines, each once, in shares if one machine is not enough",
      run_batch);
  command.required(
      "jobs", o.jobs_file,
      "file with one command line per row, with or without 'loopwarden'; # begins a comment");
  command.option("--out", o.out,
                 "folder for exit codes and outputs; default JOBS.results; an earlier run in it is "
                 "continued");
  command.option("--shard", o.shard, "k/N: the k-th of N shares of the rows");
  command.setting("--jobs", o.jobs, "commands at the same time; most commands use all cores",
                  between(1, 1024));
  command.flag("--retry", o.retry, "run only the commands that failed");
  command.flag("--json", o.json, "print all rows with their exit codes");
  command.footer(
      "Exit code 65 if a command failed.\nExample: loopwarden batch jobs.txt --shard 1/4");
}

}  // namespace loopwarden::workbench
