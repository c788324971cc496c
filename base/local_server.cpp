// SPDX-License-Identifier: Apache-2.0
#include "base/local_server.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <utility>

#include "base/local_listener.hpp"

namespace loopwarden::base {
namespace {

using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kAcceptPause{500};
constexpr milliseconds kLaterPause{10};

}  // namespace

// One listening socket with its peers.
class LocalServer::Socket {
 public:
  Socket(LocalSocketSettings settings, Handler handler)
      : settings_(std::move(settings)),
        handler_(std::move(handler)),
        fd_(local_listener(settings_.path, settings_.group, settings_.most_peers)),
        tokens_(settings_.lines_per_second) {
    peers_.reserve(settings_.most_peers);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    for (const Peer& peer : peers_) ::close(peer.fd);
    ::close(fd_);
    unlink(settings_.path.c_str());
  }

  const std::string& path() const noexcept { return settings_.path; }
  // Returns how long this socket can wait if no descriptor becomes ready, at most `most`.
  milliseconds patience(Steady::time_point now, milliseconds most);
  void wait_for(std::vector<pollfd>& waiting, Steady::time_point now) const;
  // `waiting`: the entries of this socket, as wait_for() appended them.
  void serve(const pollfd* waiting, Steady::time_point now) noexcept;

 private:
  struct Peer {
    int fd = -1;
    unsigned uid = 0;
    std::string received{};
    Later later{};  // pending answer; empty: none
    std::string to_send{};
    std::size_t sent = 0;      // of to_send
    Steady::time_point moved;  // when it last took something of its answer
    bool ended = false;        // it sends no more

    std::size_t unsent() const noexcept { return to_send.size() - sent; }
    bool rests() const noexcept { return unsent() > 0 || later; }
    bool asks() const noexcept { return !rests() && received.find('\n') != std::string::npos; }
  };

  void refill(Steady::time_point now);
  bool may_answer() const noexcept;
  void accept_peer(Steady::time_point now);
  static bool receive(Peer& peer);
  void answer(Peer& peer, Steady::time_point now);
  static void give(Peer& peer, std::string line, Steady::time_point now);
  static bool send_pending(Peer& peer, Steady::time_point now);
  void keep_open(std::size_t next) noexcept;
  bool move(Peer& peer, short ready, Steady::time_point now) noexcept;

  LocalSocketSettings settings_;
  Handler handler_;
  int fd_;
  std::vector<Peer> peers_;
  std::size_t first_ = 0;  // peer that is served first in the next round
  std::size_t left_ = 0;   // answers left in this round
  double tokens_;          // answers that the rate allows now
  Steady::time_point refilled_ = Steady::now();
  // No descriptor is free: new connections stay in the queue until then, and this thread does not
  // spin.
  Steady::time_point accept_again_{};
};

void LocalServer::Socket::refill(Steady::time_point now) {
  const double elapsed_s = std::chrono::duration<double>(now - refilled_).count();
  refilled_ = now;
  tokens_ = std::min(tokens_ + elapsed_s * settings_.lines_per_second,
                     std::max(settings_.lines_per_second, 1.0));
}

bool LocalServer::Socket::may_answer() const noexcept {
  if (settings_.lines_per_second > 0.0 && tokens_ < 1.0) return false;
  std::size_t unsent = 0;
  for (const Peer& peer : peers_) unsent += peer.unsent();
  return unsent <= kMostUnsent;
}

milliseconds LocalServer::Socket::patience(Steady::time_point now, milliseconds most) {
  refill(now);
  if (std::any_of(peers_.begin(), peers_.end(), [](const Peer& peer) { return !!peer.later; })) {
    most = std::min(most, kLaterPause);
  }
  const bool asked =
      std::any_of(peers_.begin(), peers_.end(), [](const Peer& peer) { return peer.asks(); });
  if (!asked) return most;
  if (may_answer()) return milliseconds(0);
  // it waits until its peers have read
  if (settings_.lines_per_second <= 0.0 || tokens_ >= 1.0) return most;
  const double wait_s = (1.0 - tokens_) / settings_.lines_per_second;
  return std::min(most, milliseconds(1 + std::lround(wait_s * 1000.0)));
}

void LocalServer::Socket::wait_for(std::vector<pollfd>& waiting, Steady::time_point now) const {
  waiting.push_back({fd_, static_cast<short>(now >= accept_again_ ? POLLIN : 0), 0});
  for (const Peer& peer : peers_) {
    // A peer is not read from while it has a complete line here, waits for an answer or does not
    // read its answer. Such a peer is not polled, so its hang-up is not seen either.
    const short events = peer.unsent() > 0 ? POLLOUT : POLLIN;
    const bool rests = peer.unsent() == 0 && (peer.asks() || peer.ended || peer.later);
    waiting.push_back({rests ? -1 : peer.fd, events, 0});
  }
}

void LocalServer::Socket::serve(const pollfd* waiting, Steady::time_point now) noexcept {
  left_ = settings_.lines_a_round > 0 ? settings_.lines_a_round : peers_.size();
  const std::size_t count = peers_.size();
  std::size_t next = first_ + 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (first_ + k) % count;
    const bool could = left_ > 0;
    if (!move(peers_[i], waiting[i + 1].revents, now)) {
      ::close(peers_[i].fd);
      peers_[i].fd = -1;
    }
    if (could && left_ == 0) next = i + 1;
  }
  keep_open(next);
  if ((waiting->revents & POLLIN) != 0) accept_peer(now);
}

// Works in place, because a failure half way would lose peers.
void LocalServer::Socket::keep_open(std::size_t next) noexcept {
  const std::size_t count = peers_.size();
  std::size_t kept = 0;
  first_ = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i == next % count) first_ = kept;
    if (peers_[i].fd < 0) continue;
    if (kept != i) peers_[kept] = std::move(peers_[i]);
    ++kept;
  }
  peers_.resize(kept);
  if (first_ >= kept) first_ = 0;
}

// Returns false if the connection must end, also if memory for the peer's request runs out.
bool LocalServer::Socket::move(Peer& peer, short ready, Steady::time_point now) noexcept {
  try {
    if ((ready & (POLLERR | POLLNVAL)) != 0) return false;
    if ((ready & (POLLIN | POLLHUP)) != 0 && !peer.rests() && !receive(peer)) return false;
    if (peer.later) {
      if (std::optional<std::string> line = peer.later()) give(peer, std::move(*line), now);
    }
    if (peer.asks() && left_ > 0 && may_answer()) answer(peer, now);
    if (!send_pending(peer, now)) return false;
    return !peer.ended || peer.rests() || peer.asks();
  } catch (const std::exception&) {
    return false;
  }
}

void LocalServer::Socket::accept_peer(Steady::time_point now) {
  const int fd = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) {
    if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) {
      accept_again_ = now + kAcceptPause;
    }
    return;
  }
  if (peers_.size() >= settings_.most_peers) {
    ::close(fd);
    return;
  }
  ucred credentials{};
  socklen_t length = sizeof credentials;
  getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &length);
  peers_.push_back({.fd = fd, .uid = credentials.uid, .moved = now});
}

bool LocalServer::Socket::receive(Peer& peer) {
  std::array<char, 4096> buffer{};
  const ssize_t n = recv(peer.fd, buffer.data(), buffer.size(), 0);
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  if (n == 0) {
    peer.ended = true;
    return true;
  }
  peer.received.append(buffer.data(), static_cast<std::size_t>(n));
  return peer.received.size() <= kLongestLine || peer.asks();
}

void LocalServer::Socket::answer(Peer& peer, Steady::time_point now) {
  const std::size_t end = peer.received.find('\n');
  --left_;
  if (settings_.lines_per_second > 0.0) tokens_ -= 1.0;
  Answer made = handler_(std::string_view(peer.received).substr(0, end), peer.uid);
  peer.received.erase(0, end + 1);
  if (auto* line = std::get_if<std::string>(&made)) return give(peer, std::move(*line), now);
  peer.later = std::move(std::get<Later>(made));
}

void LocalServer::Socket::give(Peer& peer, std::string line, Steady::time_point now) {
  peer.later = nullptr;
  peer.to_send = std::move(line) + '\n';
  peer.sent = 0;
  peer.moved = now;
}

bool LocalServer::Socket::send_pending(Peer& peer, Steady::time_point now) {
  while (peer.unsent() > 0) {
    const ssize_t n = send(peer.fd, peer.to_send.data() + peer.sent, peer.unsent(), MSG_NOSIGNAL);
    if (n < 0) {
      return (errno == EAGAIN || errno == EINTR) && now - peer.moved <= kReadPatience;
    }
    peer.sent += static_cast<std::size_t>(n);
    peer.moved = now;
  }
  // Frees the memory of a large answer.
  if (peer.sent > 0) peer.to_send = {};
  peer.sent = 0;
  return true;
}

LocalServer::LocalServer() = default;
LocalServer::~LocalServer() = default;

void LocalServer::listen(const LocalSocketSettings& settings, Handler handler) {
  sockets_.push_back(std::make_unique<Socket>(settings, std::move(handler)));
}

void LocalServer::close(const std::string& path) noexcept {
  std::erase_if(sockets_, [&](const auto& socket) { return socket->path() == path; });
}

bool LocalServer::listens(const std::string& path) const noexcept {
  return std::any_of(sockets_.begin(), sockets_.end(),
                     [&](const auto& socket) { return socket->path() == path; });
}

void LocalServer::serve(milliseconds timeout) {
  std::vector<pollfd> waiting;
  std::vector<std::size_t> parts;
  const Steady::time_point before = Steady::now();
  for (const auto& socket : sockets_) {
    parts.push_back(waiting.size());
    timeout = socket->patience(before, timeout);
    socket->wait_for(waiting, before);
  }
  if (poll(waiting.data(), waiting.size(), static_cast<int>(timeout.count())) < 0) return;
  const Steady::time_point now = Steady::now();
  for (std::size_t i = 0; i < sockets_.size(); ++i) {
    sockets_[i]->serve(waiting.data() + parts[i], now);
  }
}

}  // namespace loopwarden::base
