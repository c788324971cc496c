// SPDX-License-Identifier: Apache-2.0
#include "hal/os/local_socket.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace loopwarden::hal::os {
namespace {

constexpr std::chrono::milliseconds kAcceptPause{500};

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw std::runtime_error("socket path is longer than " +
                             std::to_string(sizeof address.sun_path - 1) + " characters: " + path);
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

std::runtime_error failure(const std::string& what) {
  return std::runtime_error(what + ": " + std::strerror(errno));
}

int try_connect(const std::string& path) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw failure("socket");
  const sockaddr_un address = address_of(path);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  const int error = errno;
  close(fd);
  errno = error;
  return -1;
}

}  // namespace

LocalClient::LocalClient(const std::string& path) : fd_(try_connect(path)) {
  if (fd_ < 0) throw failure("no daemon answers at " + path);
}

LocalClient::~LocalClient() { close(fd_); }

std::string LocalClient::request(std::string_view line, std::chrono::milliseconds timeout) {
  std::string message(line);
  message += '\n';
  for (std::size_t sent = 0; sent < message.size();) {
    const ssize_t n = send(fd_, message.data() + sent, message.size() - sent, MSG_NOSIGNAL);
    if (n < 0) throw failure("the daemon closed the connection");
    sent += static_cast<std::size_t>(n);
  }
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const std::size_t end = received_.find('\n');
    if (end != std::string::npos) {
      std::string answer = received_.substr(0, end);
      received_.erase(0, end + 1);
      return answer;
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    pollfd waiting{fd_, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) throw std::runtime_error("the daemon did not answer in time");
    std::array<char, 4096> buffer{};
    const ssize_t n = recv(fd_, buffer.data(), buffer.size(), 0);
    if (n <= 0) throw std::runtime_error("the daemon closed the connection");
    received_.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

LocalServer::LocalServer(std::string path, Handler handler)
    : path_(std::move(path)), handler_(std::move(handler)) {
  const int other = try_connect(path_);
  if (other >= 0) {
    close(other);
    throw std::runtime_error("another daemon already listens at " + path_);
  }
  unlink(path_.c_str());
  fd_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) throw failure("socket");
  peers_.reserve(kMostPeers);
  const sockaddr_un address = address_of(path_);
  const mode_t before = umask(0117);  // read and write for owner and group from the first moment
  const int bound = bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  umask(before);
  if (bound != 0 || listen(fd_, kMostPeers) != 0) {
    const int error = errno;
    close(fd_);
    errno = error;
    throw failure("can't listen at " + path_);
  }
}

LocalServer::~LocalServer() {
  for (const Peer& peer : peers_) close(peer.fd);
  close(fd_);
  unlink(path_.c_str());
}

void LocalServer::accept_peer() {
  const int fd = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) {
    if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) {
      accept_again_ = std::chrono::steady_clock::now() + kAcceptPause;
    }
    return;
  }
  if (peers_.size() >= kMostPeers) {
    close(fd);
    return;
  }
  ucred credentials{};
  socklen_t length = sizeof credentials;
  getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &length);
  peers_.push_back({fd, credentials.uid, {}, {}});
}

bool LocalServer::receive(Peer& peer) {
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t n = recv(peer.fd, buffer.data(), buffer.size(), 0);
    if (n == 0) return false;
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    peer.received.append(buffer.data(), static_cast<std::size_t>(n));
    answer_lines(peer);
    if (peer.received.size() > kLongestLine) return false;
  }
}

void LocalServer::answer_lines(Peer& peer) {
  for (std::size_t end = peer.received.find('\n'); end != std::string::npos;
       end = peer.received.find('\n')) {
    peer.to_send += handler_(std::string_view(peer.received).substr(0, end), peer.uid) + '\n';
    peer.received.erase(0, end + 1);
  }
}

bool LocalServer::send_pending(Peer& peer) {
  while (!peer.to_send.empty()) {
    const ssize_t n = send(peer.fd, peer.to_send.data(), peer.to_send.size(), MSG_NOSIGNAL);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    peer.to_send.erase(0, static_cast<std::size_t>(n));
  }
  return true;
}

// False if the connection is to end; also where there is no memory for the peer's request.
bool LocalServer::serve_peer(Peer& peer, short ready) noexcept {
  try {
    if ((ready & (POLLERR | POLLNVAL)) != 0) return false;
    if ((ready & (POLLIN | POLLHUP)) != 0 && !receive(peer)) return false;
    return send_pending(peer);
  } catch (const std::exception&) {
    return false;
  }
}

void LocalServer::serve(std::chrono::milliseconds timeout) {
  const bool accepts = std::chrono::steady_clock::now() >= accept_again_;
  std::vector<pollfd> waiting{{fd_, static_cast<short>(accepts ? POLLIN : 0), 0}};
  for (const Peer& peer : peers_) {
    // A peer that does not read its answers gets no new ones until it does.
    const short events = peer.to_send.empty() ? POLLIN : POLLOUT;
    waiting.push_back({peer.fd, events, 0});
  }
  if (poll(waiting.data(), waiting.size(), static_cast<int>(timeout.count())) <= 0) return;
  // In place: nothing may fail half way.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < peers_.size(); ++i) {
    if (!serve_peer(peers_[i], waiting[i + 1].revents)) {
      close(peers_[i].fd);
      continue;
    }
    if (kept != i) peers_[kept] = std::move(peers_[i]);
    ++kept;
  }
  peers_.resize(kept);
  if ((waiting.front().revents & POLLIN) != 0) accept_peer();
}

}  // namespace loopwarden::hal::os
