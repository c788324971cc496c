// SPDX-License-Identifier: Apache-2.0
#include "page/box/line_client.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "record/file.hpp"

namespace loopwarden::page {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostAnswerBytes = 256UL * 1024UL * 1024UL;
constexpr std::size_t kPieceBytes = 64UL * 1024UL;

int connected(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) throw DaemonDown(path + ": the path is too long");
  std::copy(path.begin(), path.end(), address.sun_path);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd >= 0 && ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    return fd;
  }
  const int error = errno;
  if (fd >= 0) ::close(fd);
  throw DaemonDown("no daemon answers at " + path + ": " + record::error_text(error));
}

}  // namespace

LineClient::LineClient(const std::string& path) : path_(path), fd_(connected(path)) {}

LineClient::~LineClient() { ::close(fd_); }

void LineClient::wait(short events, Moment until) const {
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    pollfd waiting{fd_, events, 0};
    const int ready =
        ::poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready > 0) return;
    if (ready == 0) throw DaemonDown("the daemon at " + path_ + " does not answer in time");
    if (errno != EINTR) throw DaemonDown(path_ + ": " + record::error_text(errno));
  }
}

void LineClient::send(std::string_view bytes, Moment until) const {
  while (!bytes.empty()) {
    const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
    } else if (errno == EAGAIN) {
      wait(POLLOUT, until);
    } else if (errno != EINTR) {
      throw DaemonDown("the daemon closed the connection");
    }
  }
}

std::string LineClient::request(std::string_view line, std::chrono::milliseconds patience) {
  const Moment until = Clock::now() + patience;
  send(std::string(line) + '\n', until);
  std::string answer;
  std::array<char, kPieceBytes> piece;  // NOLINT: filled by recv
  while (answer.size() < kMostAnswerBytes) {
    wait(POLLIN, until);
    const ssize_t n = ::recv(fd_, piece.data(), piece.size(), 0);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (n <= 0) throw DaemonDown("the daemon closed the connection");
    answer.append(piece.data(), static_cast<std::size_t>(n));
    if (answer.back() == '\n') {  // one line is asked for, so one comes
      answer.pop_back();
      return answer;
    }
  }
  throw DaemonDown("the daemon's answer does not end");
}

}  // namespace loopwarden::page
