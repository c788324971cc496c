// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/syslog_channel.hpp"

#include <fmt/format.h>
#include <linux/sockios.h>
#include <netdb.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "services/notify/channels/syslog_text.hpp"

namespace loopwarden::notify {
namespace {

using Transport = SyslogSettings::Transport;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kConfirmationPause{5};

int connected_local(const std::string& path, std::string& why) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    why = "the socket's path is too long";
    return -1;
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    return fd;
  }
  why = fmt::format("{}: {}", path, std::strerror(errno));
  if (fd >= 0) close(fd);
  return -1;
}

int connected_udp(const std::string& host, std::uint16_t port, std::string& why) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), fmt::format("{}", port).c_str(), &wanted, &found);
  if (error != 0) {
    why = fmt::format("{}: {}", host, gai_strerror(error));
    return -1;
  }
  int fd = -1;
  for (const addrinfo* one = found; one != nullptr && fd < 0; one = one->ai_next) {
    fd = socket(one->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0 || connect(fd, one->ai_addr, one->ai_addrlen) == 0) continue;
    close(fd);
    fd = -1;
  }
  if (fd < 0) why = fmt::format("{} port {}: {}", host, port, std::strerror(errno));
  freeaddrinfo(found);
  return fd;
}

bool wait_for(curl_socket_t fd, short events) {
  pollfd waiting{fd, events, 0};
  constexpr int kWait_ms = 100;
  return poll(&waiting, 1, kWait_ms) > 0;
}

curl_socket_t socket_of(CURL* handle) {
  curl_socket_t fd = CURL_SOCKET_BAD;
  curl_easy_getinfo(handle, CURLINFO_ACTIVESOCKET, &fd);
  return fd;
}

// Sends all bytes. Returns the error, or an empty string if all were sent.
std::string send_all(CURL* handle, std::string_view bytes, Clock::time_point until,
                     const std::atomic<bool>& quit) {
  while (!bytes.empty()) {
    std::size_t n = 0;
    const CURLcode code = curl_easy_send(handle, bytes.data(), bytes.size(), &n);
    if (code != CURLE_OK && code != CURLE_AGAIN) return curl_easy_strerror(code);
    bytes.remove_prefix(code == CURLE_OK ? n : 0);
    if (quit || Clock::now() > until) return "the collector does not take it in time";
    if (code == CURLE_AGAIN) wait_for(socket_of(handle), POLLOUT);
  }
  return {};
}

// Waits until the peer has confirmed the last byte: bytes in the kernel may still be lost.
std::string wait_confirmed(curl_socket_t fd, Clock::time_point until,
                           const std::atomic<bool>& quit) {
  for (;;) {
    int unconfirmed = 0;
    if (ioctl(fd, SIOCOUTQ, &unconfirmed) != 0) return std::strerror(errno);
    if (unconfirmed == 0) break;
    if (quit || Clock::now() > until) return "the collector does not confirm it in time";
    std::this_thread::sleep_for(kConfirmationPause);
  }
  int error = 0;
  socklen_t length = sizeof error;
  getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &length);
  return error == 0 ? std::string() : std::strerror(error);
}

}  // namespace

SyslogChannel::SyslogChannel(SyslogSettings settings, Sender sender)
    : settings_(std::move(settings)), sender_(std::move(sender)) {}

SyslogChannel::~SyslogChannel() {
  if (datagram_ >= 0) close(datagram_);
}

Delivery SyslogChannel::send(const Message& message, const std::atomic<bool>& quit) {
  const bool stream =
      settings_.transport == Transport::tcp || settings_.transport == Transport::tls;
  Delivery delivery;
  for (const Event& event : message.events) {
    const std::string line = syslog_line(event, message, sender_, settings_,
                                         stream ? kMostStreamBytes : kMostDatagramBytes);
    delivery = stream ? send_stream(octet_frame(line), quit) : send_datagram(line);
    if (delivery.outcome != Delivery::Outcome::sent) break;
  }
  return delivery;
}

std::string SyslogChannel::open_datagram() {
  std::string why;
  datagram_ = settings_.transport == Transport::local
                  ? connected_local(settings_.socket, why)
                  : connected_udp(settings_.host, settings_.port, why);
  return why;
}

Delivery SyslogChannel::send_datagram(const std::string& line) {
  // Tries a second time because the first send fails if the receiver was restarted in between.
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (datagram_ < 0) {
      const std::string why = open_datagram();
      if (datagram_ < 0) return later(why);
    }
    if (::send(datagram_, line.data(), line.size(), MSG_NOSIGNAL) >= 0) {
      return notify::sent("has left; a datagram is not confirmed");
    }
    const int error = errno;
    close(datagram_);
    datagram_ = -1;
    if (error == EAGAIN) return later("the receiver is full");
  }
  return later(fmt::format("nobody takes it: {}", std::strerror(errno)));
}

// Collectors never send data: a readable socket means that the connection has ended.
bool SyslogChannel::connection_lives() {
  if (!stream_) return false;
  char byte = 0;
  std::size_t n = 0;
  return curl_easy_recv(stream_->handle(), &byte, 1, &n) == CURLE_AGAIN;
}

Delivery SyslogChannel::send_stream(const std::string& line, const std::atomic<bool>& quit) {
  const Clock::time_point until =
      Clock::now() + std::chrono::milliseconds(settings_.time_outs.all_ms);
  if (!connection_lives()) {
    // libcurl connects and handles TLS; no HTTP is sent.
    const bool tls = settings_.transport == Transport::tls;
    const bool v6 = settings_.host.find(':') != std::string::npos;
    stream_ = std::make_unique<CurlRequest>(
        fmt::format("{}://{}{}{}:{}", tls ? "https" : "http", v6 ? "[" : "", settings_.host,
                    v6 ? "]" : "", settings_.port),
        tls ? "https" : "http", settings_.tls, settings_.time_outs);
    stream_->set(CURLOPT_CONNECT_ONLY, 1L);
    stream_->set(CURLOPT_SSL_ENABLE_ALPN, 0L);
    stream_->set(CURLOPT_PROXY, "");
    const CURLcode code = stream_->perform(quit);
    if (code != CURLE_OK) {
      const std::string why = stream_->error(code);
      stream_.reset();
      return later(why);
    }
  }
  std::string why = send_all(stream_->handle(), line, until, quit);
  if (why.empty()) why = wait_confirmed(socket_of(stream_->handle()), until, quit);
  // A collector that is ending may confirm bytes and drop them unread.
  if (why.empty() && !connection_lives()) why = "the collector ended the connection";
  if (!why.empty()) {
    stream_.reset();
    return later(why);
  }
  return notify::sent("confirmed by the collector's TCP");
}

}  // namespace loopwarden::notify
