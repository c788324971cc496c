// SPDX-License-Identifier: Apache-2.0
#include "daemon/external/feed_server.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <limits>
#include <utility>

#include "base/clock.hpp"
#include "base/local_listener.hpp"
#include "daemon/protocol/feed_line.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::external {
namespace {

using hal::feed::Feeder;
using protocol::FeedLine;

constexpr std::chrono::milliseconds kRound{100};
constexpr std::chrono::milliseconds kHeldUp{
    10};  // between two checks while a feeder is above its rate
constexpr std::chrono::minutes kBetweenWarnings{1};
constexpr std::size_t kMostWaiting = 16;
constexpr std::size_t kMostUnsent = 64UL * 1024UL;

void count(Feeder::Counters::Counter& counter) noexcept {
  counter.fetch_add(1, std::memory_order_relaxed);
}

hal::Quality quality_of(protocol::FedValue::Quality quality) noexcept {
  switch (quality) {
    case protocol::FedValue::Quality::good: return hal::Quality::good;
    case protocol::FedValue::Quality::uncertain: return hal::Quality::uncertain;
    case protocol::FedValue::Quality::bad: break;
  }
  return hal::Quality::bad;
}

hal::Reason reason_of(protocol::FedValue::Reason reason) noexcept {
  switch (reason) {
    case protocol::FedValue::Reason::timeout: return hal::Reason::source_silent;
    case protocol::FedValue::Reason::death: return hal::Reason::source_dead;
    case protocol::FedValue::Reason::link: return hal::Reason::link_lost;
    case protocol::FedValue::Reason::source: break;
  }
  return hal::Reason::source;
}

}  // namespace

FeedServer::FeedServer(std::string path, std::vector<Right> rights, std::optional<unsigned> group,
                       hal::feed::FeedTable& board, double bytes_per_second)
    : path_(std::move(path)),
      rights_(std::move(rights)),
      group_(group),
      board_(board),
      bytes_per_second_(bytes_per_second) {
  open();
}

FeedServer::~FeedServer() {
  stop();
  for (Peer& peer : peers_) ::close(peer.fd);
  if (listener_ < 0) return;
  ::close(listener_);
  ::unlink(path_.c_str());
}

void FeedServer::open() {
  if (listener_ >= 0) return;
  opening_.run([this] { listener_ = base::local_listener(path_, group_, kMostWaiting); });
}

void FeedServer::start() {
  thread_.start({.name = "lw-feed"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) {
      try {
        serve(kRound);
      } catch (const std::exception& e) {
        spdlog::error("feed socket: {}", e.what());
        ticks_.fetch_add(1, std::memory_order_relaxed);
      }
    }
  });
}

void FeedServer::stop() noexcept {
  quit_ = true;
  thread_.join();
}

void FeedServer::serve(std::chrono::milliseconds timeout) {
  open();
  std::vector<pollfd> waiting{{listener_, POLLIN, 0}};
  const Steady::time_point before = Steady::now();
  for (Peer& peer : peers_) {
    const double passed_s = std::chrono::duration<double>(before - peer.refilled).count();
    peer.refilled = before;
    peer.allowance = std::min(peer.allowance + passed_s * bytes_per_second_, bytes_per_second_);
    const bool held_up = peer.allowance <= 0.0;
    if (held_up) timeout = std::min(timeout, kHeldUp);
    // A peer that does not read its answers is not read from.
    const short events = !peer.to_send.empty() ? POLLOUT : POLLIN;
    waiting.push_back({held_up && peer.to_send.empty() ? -1 : peer.fd, events, 0});
  }
  const int ready = ::poll(waiting.data(), waiting.size(), static_cast<int>(timeout.count()));
  for (std::size_t i = 0; ready > 0 && i < peers_.size(); ++i) {
    if (!move(peers_[i], waiting[i + 1].revents)) let_go(peers_[i]);
  }
  drop_closed();
  if (ready > 0 && (waiting.front().revents & POLLIN) != 0) accept_peer();
  drop_closed();
  ticks_.fetch_add(1, std::memory_order_relaxed);
}

void FeedServer::let_go(Peer& peer) noexcept {
  ::close(peer.fd);
  peer.fd = -1;
  if (peer.feeder != nullptr)
    peer.feeder->counters().connected.store(false, std::memory_order_relaxed);
}

void FeedServer::drop_closed() {
  std::erase_if(peers_, [](const Peer& peer) { return peer.fd < 0; });
}

void FeedServer::accept_peer() {
  const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return;
  ucred credentials{};
  socklen_t length = sizeof credentials;
  const bool known = ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &length) == 0;
  const auto right = std::find_if(rights_.begin(), rights_.end(), [&](const Right& one) {
    return known && one.uid == credentials.uid;
  });
  if (right == rights_.end()) {
    ::close(fd);
    refused_.fetch_add(1, std::memory_order_relaxed);
    if (Steady::now() < refusal_log_again_) return;
    refusal_log_again_ = Steady::now() + kBetweenWarnings;
    spdlog::warn(
        "feed.sock: uid {} is not a feeder in loopwardend.yaml ({} refused since the start)",
        credentials.uid, refused());
    return;
  }
  peers_.push_back({.fd = fd,
                    .uid = credentials.uid,
                    .allowance = bytes_per_second_,
                    .refilled = Steady::now()});
  const bool shared = std::count_if(rights_.begin(), rights_.end(), [&](const Right& one) {
                        return one.uid == credentials.uid;
                      }) > 1;
  if (!shared) assign(peers_.back(), *right);
}

void FeedServer::assign(Peer& peer, const Right& right) {
  Feeder& feeder = board_.feeder(right.feeder);
  for (Peer& other : peers_) {
    if (other.feeder == &feeder && other.fd >= 0 && &other != &peer) let_go(other);
  }
  peer.name = &right.feeder;
  peer.feeder = &feeder;
  feeder.counters().connected.store(true, std::memory_order_relaxed);
  count(feeder.counters().connections);
}

bool FeedServer::identify(Peer& peer, std::string_view line) {
  std::string name;
  std::string id;
  try {
    name = protocol::read_feed_line(line, id).feeder;
  } catch (const protocol::RequestError&) {
    // It names no feeder.
  }
  const auto right = std::find_if(rights_.begin(), rights_.end(), [&](const Right& one) {
    return one.uid == peer.uid && one.feeder == name;
  });
  if (right != rights_.end()) {
    assign(peer, *right);
    return true;
  }
  spdlog::warn(
      "feed.sock: several feeders have uid {}, and this one is {}. Set `feeder` in its feed.yaml "
      "or "
      "opcua.yaml",
      peer.uid, name.empty() ? "not named" : "named '" + name + "'");
  return false;
}

// Returns false if the connection must be closed.
bool FeedServer::move(Peer& peer, short ready) {
  if ((ready & (POLLERR | POLLNVAL)) != 0) return false;
  if ((ready & POLLOUT) != 0) {
    const ssize_t n = ::send(peer.fd, peer.to_send.data(), peer.to_send.size(), MSG_NOSIGNAL);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    peer.to_send.erase(0, static_cast<std::size_t>(n));
    return true;
  }
  return (ready & (POLLIN | POLLHUP)) == 0 || receive(peer);
}

bool FeedServer::receive(Peer& peer) {
  std::array<char, kMostBytesARound> buffer;  // NOLINT: only the filled part is read
  const ssize_t n = ::recv(peer.fd, buffer.data(), buffer.size(), 0);
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  if (n == 0) return false;
  peer.allowance -= static_cast<double>(n);
  peer.received.append(buffer.data(), static_cast<std::size_t>(n));
  if (!take_lines(peer)) return false;
  return peer.to_send.size() <= kMostUnsent;
}

bool FeedServer::take_lines(Peer& peer) {
  std::size_t from = 0;
  for (std::size_t end = peer.received.find('\n'); end != std::string::npos;
       end = peer.received.find('\n', from)) {
    const std::string_view line = std::string_view(peer.received).substr(from, end - from);
    from = end + 1;
    if (std::exchange(peer.passes_over, false)) continue;
    if (peer.feeder == nullptr && !identify(peer, line)) return false;
    if (line.size() > FeedLine::kLongest) {
      bad_line(peer, "it is longer than 64 kB");
    } else {
      take(peer, line);
    }
  }
  peer.received.erase(0, from);
  if (peer.received.size() <= FeedLine::kLongest) return true;
  if (peer.feeder == nullptr) return false;
  if (!std::exchange(peer.passes_over, true)) bad_line(peer, "it is longer than 64 kB");
  peer.received.clear();
  return true;
}

void FeedServer::take(Peer& peer, std::string_view line) {
  count(peer.feeder->counters().lines);
  std::string id;
  try {
    const FeedLine feed = protocol::read_feed_line(line, id);
    const hal::feed::Arrival arrival{.now_ns = base::MonotonicClock().now_ns(),
                                     .utc_s = static_cast<double>(base::utc_ms()) * 1e-3};
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    std::size_t taken = 0;
    for (const protocol::FedValue& fed : feed.values) {
      const bool is_word = !fed.word.empty();
      const Feeder::Put put = peer.feeder->put(
          fed.name,
          {.value = is_word ? hal::number_of_word(fed.word) : fed.value.value_or(kNone),
           .is_word = is_word,
           .quality = quality_of(fed.quality),
           .reason = reason_of(fed.reason),
           .stamp_s = fed.time_s.value_or(kNone),
           .source = fed.source},
          arrival);
      if (put == Feeder::Put::taken) ++taken;
    }
    peer.feeder->lives(arrival.now_ns);
    if (!id.empty()) peer.to_send += protocol::feed_taken(id, taken) + '\n';
  } catch (const protocol::RequestError& e) {
    bad_line(peer, e.what());
    if (!id.empty()) peer.to_send += protocol::feed_refused(id, e.what()) + '\n';
  }
}

void FeedServer::bad_line(Peer& peer, const std::string& why) {
  count(peer.feeder->counters().bad_lines);
  BadLines& bad = bad_[*peer.name];
  ++bad.since_logged;
  if (Steady::now() < bad.log_again) return;
  bad.log_again = Steady::now() + kBetweenWarnings;
  spdlog::warn("feeder {}: bad line: {} ({} since the last such message)", *peer.name, why,
               std::exchange(bad.since_logged, 0));
}

}  // namespace loopwarden::daemon::external
