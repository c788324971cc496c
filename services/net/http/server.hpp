// SPDX-License-Identifier: Apache-2.0
// The HTTP server: one event loop for all sockets, so that an idle or slow client costs a socket and some kB, no
// thread. Every wait for a client has its time-out. Beast is in server.cpp and connection.hpp only.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/net/http/admission_control.hpp"
#include "services/net/http/event_hub.hpp"
#include "services/net/http/worker_pools.hpp"
#include "services/net/http/message.hpp"

namespace loopwarden::http {

struct TlsFiles {
  std::filesystem::path certificate;  // PEM, the server's first, then the chain
  std::filesystem::path key;          // PEM
};

struct Timeouts {
  std::chrono::milliseconds handshake{10'000};
  std::chrono::milliseconds header{10'000};  // of the first request, whole
  std::chrono::milliseconds next{60'000};    // until the head of the next one is whole
  std::chrono::milliseconds body{15'000};
  std::chrono::milliseconds write{15'000};  // of 64 KiB
  std::chrono::milliseconds heartbeat{10'000};
  std::chrono::milliseconds streams{1000};  // between looks whether each of them may stay
  std::chrono::milliseconds linger{
      2000};  // for more of what a refused client still sends; `body` in all
};

// Of a page. argon2 takes 64 MiB and a second of a small box's processor: one at a time.
inline constexpr std::array<PoolSize, kPools> kPagePools{{{"pg-here", 0, 0},
                                                          {"pg-daemon", 3, 64},
                                                          {"pg-disk", 2, 32},
                                                          {"pg-login", 1, 8},
                                                          {"pg-orders", 2, 16},
                                                          {"pg-fleet", 2, 64}}};

struct ServerSettings {
  ClientLimits limits;
  Timeouts timeouts;
  std::optional<TlsFiles> tls;                      // nullopt: plain HTTP
  std::array<PoolSize, kPools> pools = kPagePools;  // without threads: all answers are made here
};

struct Counters {
  std::uint64_t connections = 0;  // now
  std::uint64_t streams = 0;      // of events, now
  std::uint64_t accepted = 0;
  std::uint64_t displaced = 0;    // went for a newcomer
  std::uint64_t turned_away = 0;  // found no room
  std::uint64_t timed_out = 0;
  std::uint64_t refused = 0;  // requests that are none, or too many
  std::uint64_t requests = 0;
  std::uint64_t bytes_sent = 0;
};

class Server {
 public:
  // Throws std::runtime_error if certificate or key can't be used.
  Server(ServerSettings settings, Handler& handler);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server();

  // Before run(). Return the port, also of port 0. Throw std::runtime_error.
  std::uint16_t listen(const std::string& address, std::uint16_t port);
  std::uint16_t adopt(int listening_socket);

  // Called on the loop's thread: every `interval`; at a signal; when the number of streams changes. What one throws is logged, and
  // it is called again the next time.
  void every(std::chrono::milliseconds interval, std::function<void()> work);
  void on_signal(int number, std::function<void()> work);
  void on_streams(std::function<void(std::size_t)> work);

  void run();   // serves until stop()
  void stop();  // from any thread

  void publish(EventKind kind, std::string data);  // from any thread
  // From any thread: a session may have ended. A stream that may not stay any longer ends, and is told so by its last event.
  void look_at_streams();
  // From the loop's thread. Throws std::runtime_error and keeps the old certificate.
  void reload_certificate();
  Counters counters() const;  // from any thread

 private:
  class Body;
  std::unique_ptr<Body> body_;
};

// Host names that a certificate is made for, in lower case. Throws std::runtime_error.
std::vector<std::string> names_in_certificate(const std::filesystem::path& certificate);

// The numeric address that a listening socket is bound to; empty if it is no IP socket.
std::string address_of_socket(int fd);

}  // namespace loopwarden::http
