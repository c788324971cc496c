// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/gap_runner.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <exception>
#include <fstream>
#include <iterator>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace loopwarden::lab::gap_study {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string read_text(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    throw fs::filesystem_error("can't read", path,
                               std::make_error_code(std::errc::no_such_file_or_directory));
  }
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string last_line(const fs::path& path) {
  std::ifstream stream(path);
  std::string last;
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

// Redirects the output of the child to files in the folder of its results.
class FileActions {
 public:
  explicit FileActions(const fs::path& out) {
    posix_spawn_file_actions_init(&actions_);
    open(STDOUT_FILENO, out / "stdout");
    open(STDERR_FILENO, out / "stderr");
  }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  void open(int descriptor, const fs::path& path) {
    posix_spawn_file_actions_addopen(&actions_, descriptor, path.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
  }
  posix_spawn_file_actions_t actions_{};
};

// `actions` null: the child uses the output streams of this program.
pid_t start(std::vector<std::string> words, const posix_spawn_file_actions_t* actions) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error =
      posix_spawn(&child, words.front().c_str(), actions, nullptr, arguments.data(), environ);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), "can't start " + words.front());
  }
  return child;
}

pid_t start_gap(const GapProgram& program, const fs::path& one_case, const fs::path& out) {
  std::vector<std::string> words{program.path.string(),
                                 "gap",
                                 (one_case / "record.csv").string(),
                                 "--model",
                                 (one_case / "model.yaml").string(),
                                 "--out",
                                 out.string(),
                                 "--json"};
  words.insert(words.end(), program.options.begin(), program.options.end());
  const FileActions actions(out);
  return start(std::move(words), actions.get());
}

struct Ended {
  int status = -1;       // of waitpid, or -1 after the time limit
  double seconds = 0.0;  // of processor time
};

Ended wait_for(pid_t child, double time_limit_s) {
  const auto limit = Clock::now() + std::chrono::duration<double>(time_limit_s);
  Ended ended;
  rusage used{};
  int status = 0;
  bool killed = false;
  while (wait4(child, &status, killed ? 0 : WNOHANG, &used) == 0) {
    if (Clock::now() >= limit) {
      kill(child, SIGKILL);
      killed = true;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  if (!killed) ended.status = status;
  for (const timeval& part : {used.ru_utime, used.ru_stime}) {
    ended.seconds += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
  }
  return ended;
}

std::string failure_of(int status, const fs::path& out) {
  if (status == -1) return "time limit";
  if (WIFSIGNALED(status)) return fmt::format("signal {}", WTERMSIG(status));
  if (WEXITSTATUS(status) != 0) {
    return fmt::format("exit code {}: {}", WEXITSTATUS(status), last_line(out / "stderr"));
  }
  return {};
}

// Leaves out the names that would be correct.
void leave_out(const Truth& truth, std::vector<std::string>& options) {
  std::set<std::string> names(truth.accept.begin(), truth.accept.end());
  names.erase("unexplained");
  names.erase("none");
  for (const std::string& name : names) {
    options.emplace_back("--without");
    options.push_back(name);
  }
}

}  // namespace

void make_cases(const fs::path& generator, const CaseOrder& order, const fs::path& folder) {
  std::vector<std::string> words{generator.string(),
                                 "--out",
                                 folder.string(),
                                 "--count",
                                 std::to_string(order.count),
                                 "--seed",
                                 std::to_string(order.seed),
                                 "--kinds",
                                 order.kinds,
                                 "--samples",
                                 std::to_string(order.samples)};
  if (order.load) words.emplace_back("--load");
  const pid_t child = start(std::move(words), nullptr);
  int status = 0;
  while (waitpid(child, &status, 0) == -1 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  constexpr int kUsage = 64;
  const std::string what = generator.filename().string() + " made no cases";
  if (WIFEXITED(status) && WEXITSTATUS(status) == kUsage) throw std::invalid_argument(what);
  throw std::system_error(std::make_error_code(std::errc::io_error), what);
}

std::vector<CaseFiles> find_cases(const fs::path& folder) {
  const bool whole = fs::exists(folder / "truth.json");
  const fs::path place = fs::absolute(folder).lexically_normal();
  const fs::path named = place.has_filename() ? place : place.parent_path();
  const fs::path parent = named.parent_path();
  std::vector<CaseFiles> cases;
  for (const Truth& truth : parse_truth(read_text((whole ? folder : parent) / "truth.json"))) {
    if (whole) {
      cases.push_back({truth, folder / truth.id});
    } else if (truth.id == named.filename()) {
      cases.push_back({truth, folder});
    }
  }
  if (cases.empty()) throw std::runtime_error("no case in " + folder.string());
  return cases;
}

Answer run_gap(const GapProgram& program, const fs::path& one_case, const fs::path& out) {
  fs::create_directories(out);
  if (program.resume && fs::exists(out / "gap.json"))
    return parse_answer(read_text(out / "gap.json"));
  const Ended ended = wait_for(start_gap(program, one_case, out), program.time_limit_s);
  Answer answer;
  answer.failure = failure_of(ended.status, out);
  if (answer.failure.empty()) {
    try {
      answer = parse_answer(read_text(out / "gap.json"));
    } catch (const std::runtime_error& e) {
      answer.failure = e.what();
    }
  }
  answer.seconds = ended.seconds;
  return answer;
}

std::vector<ScoredCase> run_cases(const GapProgram& program, const std::vector<CaseFiles>& cases,
                                  const fs::path& out, unsigned jobs,
                                  const std::function<void(std::size_t)>& progress) {
  std::vector<ScoredCase> scored(cases.size());
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::size_t done = 0;
  std::exception_ptr error;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) {
      try {
        const Truth& truth = cases[i].truth;
        GapProgram own = program;
        if (program.without_truth) leave_out(truth, own.options);
        const Answer answer = run_gap(own, cases[i].folder, out / truth.id);
        scored[i] = {truth, answer, score_case(truth, answer)};
      } catch (...) {
        const std::scoped_lock lock(mutex);
        error = std::current_exception();
        next = cases.size();
        return;
      }
      const std::scoped_lock lock(mutex);
      progress(++done);
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < std::max(jobs, 1U); ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  if (error) std::rethrow_exception(error);
  return scored;
}

}  // namespace loopwarden::lab::gap_study
