// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/tcp_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "base/file.hpp"

namespace loopwarden::daemon::gateway {
namespace {

constexpr std::size_t kHeader = 7;  // transaction, protocol, length, unit
constexpr int kFramesARound = 8;    // per client, before the next client is served
constexpr int kAcceptsARound = 64;
constexpr int kSocketBuffer = 16 * 1024;  // bytes
constexpr std::chrono::milliseconds kThrottlePause{10};
constexpr std::int64_t kAcceptPauseNs = 500'000'000;
constexpr std::uint8_t kNoSuchUnit = 0x0B;  // gateway target device failed to respond

std::string peer_name(const sockaddr_storage& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &address, sizeof v4);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return fmt::format("{}:{}", text.data(), ntohs(v4.sin_port));
  }
  sockaddr_in6 v6{};
  std::memcpy(&v6, &address, sizeof v6);
  inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  return fmt::format("[{}]:{}", text.data(), ntohs(v6.sin6_port));
}

// Fills `storage` from text. Returns the length used, or 0 if the text is not an address.
socklen_t parse(const std::string& address, std::uint16_t port, sockaddr_storage& storage) {
  sockaddr_in v4{};
  if (inet_pton(AF_INET, address.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(port);
    std::memcpy(&storage, &v4, sizeof v4);
    return sizeof v4;
  }
  sockaddr_in6 v6{};
  if (inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(port);
    std::memcpy(&storage, &v6, sizeof v6);
    return sizeof v6;
  }
  return 0;
}

}  // namespace

TcpServer::TcpServer(TcpServerSettings settings, base::PeerList peers, base::Clock& clock,
                     Answer answer)
    : settings_(std::move(settings)),
      peers_(std::move(peers)),
      clock_(clock),
      answer_(std::move(answer)),
      opening_(fmt::format("Modbus server at {} port {}", settings_.address, settings_.port)) {
  clients_.reserve(settings_.most_clients);
  if (settings_.listener >= 0) {
    // A socket from the service manager may use a port for which this process has no rights.
    fcntl(settings_.listener, F_SETFL, fcntl(settings_.listener, F_GETFL) | O_NONBLOCK);
    fcntl(settings_.listener, F_SETFD, FD_CLOEXEC);
    take_listener(settings_.listener);
  } else {
    open();
  }
}

void TcpServer::open() {
  if (listener_ >= 0) return;
  opening_.run([this] { take_listener(listener_at_address()); },
               base::RepeatedAttempt::Moment(std::chrono::nanoseconds(clock_.now_ns())));
}

void TcpServer::take_listener(int listener) {
  listener_ = listener;
  sockaddr_storage bound{};
  socklen_t bound_length = sizeof bound;
  getsockname(listener_, reinterpret_cast<sockaddr*>(&bound), &bound_length);
  sockaddr_in any{};
  std::memcpy(&any, &bound, sizeof any);  // the port has the same offset for IPv4 and IPv6
  port_ = ntohs(any.sin_port);
}

int TcpServer::listener_at_address() const {
  sockaddr_storage address{};
  const socklen_t length = parse(settings_.address, settings_.port, address);
  if (length == 0) throw std::runtime_error("not a numeric address");
  const int listener = socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener < 0) throw std::runtime_error(base::error_text(errno));
  const int on = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const auto* const raw = reinterpret_cast<const sockaddr*>(&address);
  int bound = bind(listener, raw, length);
  if (bound != 0 && errno == EADDRNOTAVAIL) {
    spdlog::warn("Modbus server: this host does not have the address {} yet", settings_.address);
    const bool v4 = address.ss_family == AF_INET;
    setsockopt(listener, v4 ? IPPROTO_IP : IPPROTO_IPV6, v4 ? IP_FREEBIND : IPV6_FREEBIND, &on,
               sizeof on);
    bound = bind(listener, raw, length);
  }
  if (bound != 0 || listen(listener, SOMAXCONN) != 0) {
    const std::string why = base::error_text(errno);
    close(listener);
    throw std::runtime_error(why);
  }
  return listener;
}

std::string TcpServer::problem() const {
  std::string why = opening_.problem();
  if (!why.empty() || has_address()) return why;
  return "Modbus server: this host has no address " + settings_.address;
}

bool TcpServer::has_address() const {
  if (settings_.listener >= 0) return true;
  sockaddr_storage address{};
  const socklen_t length = parse(settings_.address, 0, address);
  const int probe = socket(address.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return true;  // not known: no alarm
  const bool missing = bind(probe, reinterpret_cast<const sockaddr*>(&address), length) != 0 &&
                       errno == EADDRNOTAVAIL;
  close(probe);
  return !missing;
}

TcpServer::~TcpServer() {
  for (const Client& client : clients_) close(client.fd);
  if (listener_ >= 0) close(listener_);
}

void TcpServer::serve(std::chrono::milliseconds timeout, int also) {
  open();
  std::int64_t now_ns = clock_.now_ns();
  const bool accepts = now_ns >= accept_again_ns_;
  std::vector<pollfd> waiting{{listener_, static_cast<short>(accepts ? POLLIN : 0), 0}};
  waiting.reserve(clients_.size() + 2);
  for (Client& client : clients_) {
    refill(client, now_ns);
    short events = POLLIN;
    if (client.ready) {
      events = 0;
      timeout = std::min(timeout, Reply::kBetweenLooks);
    } else if (client.to_send_size > 0) {
      events = POLLOUT;
    } else if (client.tokens < 1.0) {
      events = 0;
      timeout = std::min(timeout, kThrottlePause);
    } else if (frame_size(client) > 0) {
      timeout = std::chrono::milliseconds(0);  // frames are left from the last turn
    }
    waiting.push_back({client.fd, events, 0});
  }
  waiting.push_back({also, POLLIN, 0});  // poll() ignores -1
  if (poll(waiting.data(), waiting.size(), static_cast<int>(timeout.count())) < 0) return;
  now_ns = read_ns_ = clock_.now_ns();
  const auto idle_ns = static_cast<std::int64_t>(settings_.idle_timeout_s * 1e9);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    Client& client = clients_[i];
    const short ready = waiting[i + 1].revents;
    bool alive = (ready & (POLLERR | POLLNVAL)) == 0;
    // Data that arrive with a hang-up may contain a last request; its answer would not be read.
    if (alive && (ready & POLLHUP) != 0 && (ready & POLLIN) == 0) alive = false;
    if (alive && (ready & POLLIN) != 0) alive = receive(client);
    if (alive) alive = serve_client(client, now_ns);
    if (alive) alive = now_ns - client.last_request_ns < idle_ns;
    if (!alive) {
      close(client.fd);
      continue;
    }
    if (kept != i) clients_[kept] = std::move(client);
    ++kept;
  }
  clients_.resize(kept);
  if ((waiting.front().revents & POLLIN) != 0) accept_clients(now_ns);
  counters_.clients = clients_.size();
}

void TcpServer::accept_clients(std::int64_t now_ns) {
  for (int i = 0; i < kAcceptsARound; ++i) {
    sockaddr_storage address{};
    socklen_t length = sizeof address;
    const int fd = accept4(listener_, reinterpret_cast<sockaddr*>(&address), &length,
                           SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
      // Without free descriptors, clients stay in the kernel's queue. This thread waits, so that it
      // does not spin.
      if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) {
        accept_again_ns_ = now_ns + kAcceptPauseNs;
      }
      return;
    }
    const auto from = base::address_of(reinterpret_cast<const sockaddr*>(&address));
    if (!from || !peers_.may_connect(*from)) {
      ++counters_.refused;
      close(fd);
      continue;
    }
    if (clients_.size() >= settings_.most_clients) make_room();
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    // Limits the kernel's buffers. Data that a client does not read, or that the server does not
    // want yet, stay in the client's memory.
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kSocketBuffer, sizeof kSocketBuffer);
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &kSocketBuffer, sizeof kSocketBuffer);
    Client& client = clients_.emplace_back();
    client.fd = fd;
    client.peer = {peer_name(address), peers_.may_write(*from)};
    client.last_request_ns = now_ns;
    client.tokens = settings_.requests_per_second;
    client.refilled_ns = now_ns;
    ++counters_.accepted;
  }
}

void TcpServer::make_room() {
  const auto worth_less = [](const Client& a, const Client& b) {
    return std::pair(a.asked, a.last_request_ns) < std::pair(b.asked, b.last_request_ns);
  };
  const auto worst = std::min_element(clients_.begin(), clients_.end(), worth_less);
  close(worst->fd);
  clients_.erase(worst);
  ++counters_.displaced;
}

void TcpServer::refill(Client& client, std::int64_t now_ns) const {
  const double elapsed_s = static_cast<double>(now_ns - client.refilled_ns) * 1e-9;
  client.refilled_ns = now_ns;
  client.tokens = std::min(client.tokens + elapsed_s * settings_.requests_per_second,
                           settings_.requests_per_second);
}

bool TcpServer::receive(Client& client) {
  const std::size_t room = client.received.size() - client.received_size;
  if (room == 0) return true;
  const ssize_t n = recv(client.fd, client.received.data() + client.received_size, room, 0);
  if (n == 0) return false;
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  client.received_size += static_cast<std::size_t>(n);
  return true;
}

int TcpServer::frame_size(const Client& client) {
  const auto& b = client.received;
  // Rejects a client that does not speak Modbus as early as possible, after its third byte.
  if (client.received_size >= 3 && b[2] != 0) return -1;
  if (client.received_size >= 4 && b[3] != 0) return -1;
  if (client.received_size < 6) return 0;
  const std::size_t length = static_cast<std::size_t>(b[4]) << 8 | b[5];  // unit and PDU
  if (length < 2 || length > kMostPduBytes + 1) return -1;
  return client.received_size >= 6 + length ? static_cast<int>(6 + length) : 0;
}

bool TcpServer::serve_client(Client& client, std::int64_t now_ns) {
  if (client.ready && !client.ready()) return true;
  client.ready = nullptr;
  return send_pending(client) && answer_frames(client, now_ns);
}

bool TcpServer::answer_frames(Client& client, std::int64_t now_ns) {
  for (int i = 0; i < kFramesARound; ++i) {
    const int size = frame_size(client);
    if (size < 0) {
      ++counters_.malformed;
      return false;
    }
    if (size == 0 || client.tokens < 1.0 || client.to_send_size > 0) return true;
    client.tokens -= 1.0;
    client.last_request_ns = now_ns;
    client.asked = true;
    if (!answer_frame(client, static_cast<std::size_t>(size))) return false;
  }
  return true;
}

bool TcpServer::answer_frame(Client& client, std::size_t frame) {
  ++counters_.requests;
  const std::uint8_t unit = client.received[6];
  const std::span<const std::uint8_t> request(client.received.data() + kHeader, frame - kHeader);
  Pdu reply;
  if (unit == settings_.unit || unit == 0 || unit == 255) {
    Reply made = answer_(request, client.peer);
    reply = made.pdu;
    client.ready = std::move(made.ready);
  } else {
    reply.bytes[0] = request[0] | 0x80U;
    reply.bytes[1] = kNoSuchUnit;
    reply.size = 2;
  }
  std::copy_n(client.received.begin(), 4, client.to_send.begin());  // transaction, protocol
  client.to_send[4] = static_cast<std::uint8_t>((reply.size + 1) >> 8);
  client.to_send[5] = static_cast<std::uint8_t>((reply.size + 1) & 0xFF);
  client.to_send[6] = unit;
  std::copy_n(reply.bytes.begin(), reply.size, client.to_send.begin() + kHeader);
  client.to_send_size = kHeader + reply.size;
  client.sent = 0;
  std::copy(client.received.begin() + static_cast<std::ptrdiff_t>(frame),
            client.received.begin() + static_cast<std::ptrdiff_t>(client.received_size),
            client.received.begin());
  client.received_size -= frame;
  if (client.ready && !client.ready()) return true;
  client.ready = nullptr;
  return send_pending(client);
}

bool TcpServer::send_pending(Client& client) {
  while (client.sent < client.to_send_size) {
    const ssize_t n = send(client.fd, client.to_send.data() + client.sent,
                           client.to_send_size - client.sent, MSG_NOSIGNAL);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    client.sent += static_cast<std::size_t>(n);
  }
  client.to_send_size = client.sent = 0;
  return true;
}

}  // namespace loopwarden::daemon::gateway
