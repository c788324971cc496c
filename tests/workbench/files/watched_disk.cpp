// SPDX-License-Identifier: Apache-2.0
#include "tests/workbench/files/watched_disk.hpp"

#include <fcntl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace loopwarden::tests {
namespace {

std::function<void(const DiskCall&)>& watcher() {
  static std::function<void(const DiskCall&)> seen;
  return seen;
}

void note(const DiskCall& call) {
  if (watcher()) watcher()(call);
}

void note_sync(int fd) {
  std::error_code ignored;
  const std::filesystem::path name = "/proc/self/fd/" + std::to_string(fd);
  note({.kind = DiskCall::Kind::sync,
        .path = std::filesystem::read_symlink(name, ignored),
        .to = {}});
}

}  // namespace

WatchedDisk::WatchedDisk(std::function<void(const DiskCall&)> seen) { watcher() = std::move(seen); }
WatchedDisk::~WatchedDisk() { watcher() = nullptr; }

std::size_t kill_at_every_rename(const std::function<void()>& prepare,
                                 const std::function<void()>& work,
                                 const std::function<void(std::size_t given)>& check) {
  constexpr std::size_t kMost = 200;
  for (std::size_t last = 0; last < kMost; ++last) {
    prepare();
    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("no process");
    if (child == 0) {
      std::size_t renames = 0;
      const WatchedDisk disk([&](const DiskCall& call) {
        if (call.kind == DiskCall::Kind::rename && renames++ == last) ::kill(::getpid(), SIGKILL);
      });
      try {
        work();
        ::_exit(0);
      } catch (const std::exception&) {
        ::_exit(1);
      }
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    check(last);
    if (WIFEXITED(status)) {
      if (WEXITSTATUS(status) != 0) throw std::runtime_error("the work failed");
      return last;
    }
  }
  throw std::runtime_error("the work does not end");
}

std::size_t keep_every_state(const std::function<void()>& work, const std::filesystem::path& folder,
                             const std::filesystem::path& states) {
  namespace fs = std::filesystem;
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    std::size_t kept = 0;
    const auto keep = [&] {
      fs::create_directories(states);
      fs::copy(folder, states / std::to_string(kept++), fs::copy_options::recursive);
    };
    try {
      {
        const WatchedDisk disk([&](const DiskCall& call) {
          if (call.kind == DiskCall::Kind::rename) keep();
        });
        work();
      }
      keep();
      ::_exit(0);
    } catch (const std::exception&) {
      ::_exit(1);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw std::runtime_error("the work failed");
  std::size_t kept = 0;
  while (fs::exists(states / std::to_string(kept))) ++kept;
  return kept;
}

}  // namespace loopwarden::tests

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name)
extern "C" int rename(const char* from, const char* to) noexcept {
  loopwarden::tests::note({.path = from, .to = to});
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}

extern "C" int fsync(int fd) {
  loopwarden::tests::note_sync(fd);
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

extern "C" int fdatasync(int fd) {
  loopwarden::tests::note_sync(fd);
  return static_cast<int>(::syscall(SYS_fdatasync, fd));
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
