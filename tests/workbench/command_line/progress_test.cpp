// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/progress.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdio>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::progress_test {
namespace {

using workbench::Progress;

std::chrono::steady_clock::time_point now;
std::chrono::steady_clock::time_point fake_now() { return now; }

// An hour of work, with `file` as the error output.
void work(int file) {
  std::fflush(stderr);
  const int kept = ::dup(STDERR_FILENO);
  REQUIRE(::dup2(file, STDERR_FILENO) == STDERR_FILENO);
  {
    Progress progress("commission", 60, fake_now);
    for (std::uint64_t minute = 1; minute <= 30; ++minute) {
      now += std::chrono::minutes(1);
      progress.update(minute);
    }
    std::fflush(stderr);
  }
  std::fflush(stderr);
  ::dup2(kept, STDERR_FILENO);
  ::close(kept);
}

}  // namespace

TEST_CASE("progress is drawn only on a terminal", "[command_line]") {
  const TemporaryFolder folder;
  const int log = ::open((folder / "log").c_str(), O_WRONLY | O_CREAT, 0600);
  REQUIRE(log >= 0);
  work(log);
  ::close(log);
  CHECK(read_file(folder / "log").empty());

  int ours = -1;
  int theirs = -1;
  REQUIRE(::openpty(&ours, &theirs, nullptr, nullptr, nullptr) == 0);
  work(theirs);
  std::string drawn;
  for (pollfd ready{ours, POLLIN, 0}; ::poll(&ready, 1, 0) == 1;) {
    std::array<char, 4096> some{};
    const ssize_t n = ::read(ours, some.data(), some.size());
    if (n <= 0) break;
    drawn.append(some.data(), static_cast<std::size_t>(n));
  }
  ::close(ours);
  ::close(theirs);
  CHECK(drawn.find("commission [###############...............]  50 %") != std::string::npos);
  CHECK(drawn.ends_with("\r\x1b[K"));  // and is erased at the end
}

}  // namespace loopwarden::tests::progress_test
