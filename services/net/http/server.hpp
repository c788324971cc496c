// SPDX-License-Identifier: Apache-2.0
// The HTTP server. One event loop serves all sockets, so an idle or slow client costs a socket and
// some kB, but no thread. Every wait for a client has a time-out. Only server.cpp and
// connection.hpp use Beast.
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
  std::filesystem::path certificate;  // PEM: the server's certificate, followed by its chain
  std::filesystem::path key;          // PEM
};

struct Timeouts {
  std::chrono::milliseconds handshake{10'000};
  std::chrono::milliseconds header{10'000};  // until the whole first request head is received
  std::chrono::milliseconds next{60'000};    // until the whole head of the next request is received
  std::chrono::milliseconds body{15'000};
  std::chrono::milliseconds write{15'000};  // per 64 KiB
  std::chrono::milliseconds heartbeat{10'000};
  std::chrono::milliseconds streams{1000};  // between two checks of whether a stream may stay
  std::chrono::milliseconds linger{
      2000};  // reading of remaining data from a refused client; `body` in all
};

// Pools of the page. argon2 takes 64 MiB and a second of a small host's processor, so only one
// log-in runs at a time.
inline constexpr std::array<PoolSize, kPools> kPagePools{{{"pg-here", 0, 0},
                                                          {"pg-daemon", 3, 64},
                                                          {"pg-disk", 2, 32},
                                                          {"pg-login", 1, 8},
                                                          {"pg-orders", 2, 16},
                                                          {"pg-fleet", 2, 64}}};

struct ServerSettings {
  ClientLimits limits;
  Timeouts timeouts;
  std::optional<TlsFiles> tls;  // nullopt: plain HTTP
  // pools without threads: all answers are made on the loop's thread
  std::array<PoolSize, kPools> pools = kPagePools;
};

struct Counters {
  std::uint64_t connections = 0;  // at present
  std::uint64_t streams = 0;      // event streams at present
  std::uint64_t accepted = 0;
  std::uint64_t displaced = 0;    // closed to make room for a new client
  std::uint64_t turned_away = 0;  // refused because no place was free
  std::uint64_t timed_out = 0;
  std::uint64_t refused = 0;  // requests that are invalid or too many
  std::uint64_t requests = 0;
  std::uint64_t bytes_sent = 0;
};

class Server {
 public:
  // Throws std::runtime_error if the certificate or key can't be used.
  Server(ServerSettings settings, Handler& handler);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server();

  // Call them before run(). They return the port, also if `port` is 0. They throw
  // std::runtime_error.
  std::uint16_t listen(const std::string& address, std::uint16_t port);
  std::uint16_t adopt(int listening_socket);

  // Register callbacks on the loop's thread: every `interval`, at a signal, when the number of
  // streams changes. An exception is logged, and the callback is called again the next time.
  void every(std::chrono::milliseconds interval, std::function<void()> work);
  void on_signal(int number, std::function<void()> work);
  void on_streams(std::function<void(std::size_t)> work);

  void run();   // serves until stop()
  void stop();  // from any thread

  void publish(EventKind kind, std::string data);  // from any thread
  // Checks the streams after a session may have ended. A stream that may not stay gets a last event
  // and is closed. From any thread.
  void look_at_streams();
  // Loads the certificate again. Call it on the loop's thread. On an error it throws
  // std::runtime_error and keeps the old certificate.
  void reload_certificate();
  Counters counters() const;  // from any thread

 private:
  class Body;
  std::unique_ptr<Body> body_;
};

// Returns the host names in a certificate, in lower case. Throws std::runtime_error.
std::vector<std::string> names_in_certificate(const std::filesystem::path& certificate);

// Returns the numeric address of a listening socket; empty if it is not an IP socket.
std::string address_of_socket(int fd);

}  // namespace loopwarden::http
