// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/probe_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>
#include <system_error>

#include "daemon/protocol/ask.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench::setup {

std::string daemon_program() {
  std::error_code ignored;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", ignored);
  for (const std::filesystem::path& place :
       {own.parent_path() / "loopwardend", own.parent_path() / "../sbin/loopwardend"}) {
    if (std::filesystem::exists(place, ignored)) return place.string();
  }
  return "loopwardend";
}

void ProbeProcess::start() {
  // A socket, because writing to a child that has ended is then an error and not a signal.
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw CommandError(kExitIo, "no socket for loopwardend --probe");
  }
  to_ = base::File(ends[0]);
  const base::File theirs(ends[1]);
  received_.clear();
  try {
    child_ = std::make_unique<base::ChildProcess>(
        daemon_program(), std::vector<std::string>{"--probe", "--config", folder_.string()},
        base::ChildSettings{
            .input = theirs.fd(), .output = theirs.fd(), .errors = STDERR_FILENO, .idle = false});
  } catch (const std::system_error& e) {
    throw CommandError(kExitIo, daemon_program() + ": " + e.code().message());
  }
}

std::string ProbeProcess::exchange(const std::string& line) {
  constexpr int kPatience_ms = 20'000;  // for a device that never answers
  if (::send(to_.fd(), line.data(), line.size(), MSG_NOSIGNAL) !=
      static_cast<ssize_t>(line.size())) {
    return {};
  }
  for (;;) {
    if (const std::size_t end = received_.find('\n'); end != std::string::npos) {
      std::string answer = received_.substr(0, end);
      received_.erase(0, end + 1);
      return answer;
    }
    pollfd waiting{to_.fd(), POLLIN, 0};
    if (::poll(&waiting, 1, kPatience_ms) <= 0) return {};
    std::array<char, 4096> bytes{};
    const ssize_t count = ::recv(to_.fd(), bytes.data(), bytes.size(), 0);
    if (count <= 0) return {};
    received_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

protocol::Probed ProbeProcess::read(const protocol::Probe& asked) {
  const nlohmann::json request = asked;
  const std::string line = request.dump() + "\n";
  constexpr int kTries = 2;  // the child may have ended before the first
  for (int i = 0; i < kTries; ++i) {
    if (!child_ || child_->ended()) start();
    const std::string answer = exchange(line);
    if (answer.empty()) {
      child_.reset();
      continue;
    }
    const nlohmann::json read = nlohmann::json::parse(answer, nullptr, false);
    if (read.is_object()) return protocol::read_answer<protocol::Probed>(read);
  }
  throw CommandError(kExitIo, "loopwardend --probe does not answer");
}

}  // namespace loopwarden::workbench::setup
