// SPDX-License-Identifier: Apache-2.0
#include "base/child_process.hpp"

#include <fcntl.h>
#include <sched.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <string_view>
#include <system_error>

namespace loopwarden::base {
namespace {

// Settings of posix_spawn that are destroyed at the end of the scope.
struct SpawnSettings {
  SpawnSettings() {
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_init(&files);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  posix_spawnattr_t attributes{};
  posix_spawn_file_actions_t files{};
};

std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

// Returns the caller's environment, in which `wanted` replaces variables of the same name.
std::vector<std::string> environment_with(const std::vector<std::string>& wanted) {
  std::vector<std::string> all = wanted;
  for (char** at = environ; *at != nullptr; ++at) {
    const std::string_view one = *at;
    const std::string_view name = one.substr(0, one.find('=') + 1);
    const bool replaced = std::any_of(wanted.begin(), wanted.end(),
                                      [&](const std::string& w) { return w.starts_with(name); });
    if (!replaced) all.emplace_back(one);
  }
  return all;
}

}  // namespace

ChildProcess::ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
                           ChildSettings wanted) {
  SpawnSettings settings;
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&settings.attributes, &none);
  posix_spawnattr_setsigdefault(&settings.attributes, &all);
  const sched_param idle{};
  posix_spawnattr_setschedpolicy(&settings.attributes, SCHED_IDLE);
  posix_spawnattr_setschedparam(&settings.attributes, &idle);
  const int scheduler = wanted.idle ? POSIX_SPAWN_SETSCHEDULER : 0;
  posix_spawnattr_setflags(
      &settings.attributes,
      static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | scheduler));
  if (wanted.input >= 0) {
    posix_spawn_file_actions_adddup2(&settings.files, wanted.input, STDIN_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&settings.files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  posix_spawn_file_actions_adddup2(&settings.files, wanted.output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(
      &settings.files, wanted.errors >= 0 ? wanted.errors : wanted.output, STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&settings.files, STDERR_FILENO + 1);

  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment = environment_with(wanted.environment);
  const int error = posix_spawnp(&pid_, program.c_str(), &settings.files, &settings.attributes,
                                 pointers_to(words).data(), pointers_to(environment).data());
  if (error != 0) throw std::system_error(error, std::generic_category(), program);
}

ChildProcess::~ChildProcess() {
  if (ended()) return;
  kill(pid_, SIGKILL);
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<int> ChildProcess::ended() {
  if (code_) return code_;
  int status = 0;
  const pid_t got = waitpid(pid_, &status, WNOHANG);
  if (got == 0 || (got < 0 && errno == EINTR)) return std::nullopt;
  constexpr int kSignalled = 128;
  constexpr int kUnknown = 255;
  code_ = got < 0             ? kUnknown
          : WIFEXITED(status) ? WEXITSTATUS(status)
                              : kSignalled + WTERMSIG(status);
  return code_;
}

void work_in_background(std::size_t most_memory_bytes, std::chrono::seconds most_processor_time) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const sched_param idle{};
  sched_setscheduler(0, SCHED_IDLE, &idle);
  const auto limit = [](auto resource, rlim_t most) {
    const rlimit both{most, most};
    setrlimit(resource, &both);
  };
  limit(RLIMIT_AS, most_memory_bytes);
  limit(RLIMIT_CPU, static_cast<rlim_t>(most_processor_time.count()));
  limit(RLIMIT_CORE, 0);
}

}  // namespace loopwarden::base
