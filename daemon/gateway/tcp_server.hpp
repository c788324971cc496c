// SPDX-License-Identifier: Apache-2.0
// Modbus TCP connections: a poll() loop that never blocks on a client.
//
// An answer that waits (Reply::ready) delays only its own client, whose further requests stay in
// its socket.
//
// The effect of one client on the others is limited:
// - An invalid frame closes its connection.
// - A client that sends slowly occupies one buffer.
// - A client that does not read its answers is not read from.
// - A client above its request rate waits.
// If all places are taken, a new client displaces a client that never sent a valid request. If
// there is none, it displaces the one whose last request is oldest.
//
// A port that is in use is tried again every second, so that the loops run meanwhile.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/gateway/modbus_answer.hpp"
#include "base/peer_list.hpp"
#include "base/clock.hpp"
#include "base/repeated_attempt.hpp"

namespace loopwarden::daemon::gateway {

struct TcpServerSettings {
  std::string address = "127.0.0.1";
  std::uint16_t port = 1502;  // 0: any, see port()
  std::uint8_t unit = 1;      // 0 and 255 are answered too, as TCP devices do
  std::size_t most_clients = 32;
  double idle_timeout_s = 60.0;        // s without a valid request
  double requests_per_second = 200.0;  // per client
  int listener = -1;  // a listening socket to take over; address and port are then ignored
};

struct TcpServerCounters {
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;    // clients that are not on the list
  std::uint64_t displaced = 0;  // closed to make room
  std::uint64_t malformed = 0;  // connections closed because of invalid data
  std::uint64_t requests = 0;
  std::size_t clients = 0;
};

class TcpServer {
 public:
  using Answer = std::function<Reply(std::span<const std::uint8_t> request, const Peer& peer)>;

  // Starts listening. If the host does not have the address yet, connections work as soon as it
  // has it. If the port can't be opened, serve() tries again.
  TcpServer(TcpServerSettings settings, base::PeerList peers, base::Clock& clock, Answer answer);
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  ~TcpServer();

  // Serves the available data. Waits at most `timeout` for data. `also`: a descriptor that ends the
  // wait when it is readable; -1: none.
  void serve(std::chrono::milliseconds timeout, int also = -1);

  // Returns 0 while the port is not open. From any thread.
  std::uint16_t port() const noexcept { return port_.load(std::memory_order_relaxed); }
  // Returns why no client can connect; empty: clients can. From any thread.
  std::string problem() const;
  // All data that arrived before this time have been read. Exceptions are clients that wait for an
  // answer, are above their rate, or sent more than the server reads in a round.
  std::int64_t read_ns() const noexcept { return read_ns_; }
  const TcpServerCounters& counters() const noexcept { return counters_; }

 private:
  void open();
  void take_listener(int listener);
  int listener_at_address() const;
  bool has_address() const;
  static constexpr std::size_t kMostFrame = 260;
  struct Client {
    int fd = -1;
    Peer peer;
    std::array<std::uint8_t, kMostFrame> received{};
    std::size_t received_size = 0;
    std::array<std::uint8_t, kMostFrame> to_send{};
    std::size_t to_send_size = 0;
    std::size_t sent = 0;
    std::function<bool()> ready;       // condition of a waiting answer; empty: no answer waits
    std::int64_t last_request_ns = 0;  // time of the last request, or of the connection
    bool asked = false;                // has sent a valid request
    double tokens = 0.0;               // requests it may send at once
    std::int64_t refilled_ns = 0;
  };

  void accept_clients(std::int64_t now_ns);
  void make_room();
  bool serve_client(Client& client, std::int64_t now_ns);
  bool receive(Client& client);
  bool answer_frames(Client& client, std::int64_t now_ns);
  bool answer_frame(Client& client, std::size_t frame_size);
  static bool send_pending(Client& client);
  void refill(Client& client, std::int64_t now_ns) const;
  // Returns the bytes of the first frame in the buffer; 0: incomplete; nullopt: invalid.
  static int frame_size(const Client& client);

  TcpServerSettings settings_;
  base::PeerList peers_;
  base::Clock& clock_;
  Answer answer_;
  int listener_ = -1;  // -1: not open yet
  base::RepeatedAttempt opening_;
  std::int64_t accept_again_ns_ = 0;
  std::int64_t read_ns_ = 0;
  std::atomic<std::uint16_t> port_{0};
  std::vector<Client> clients_;
  TcpServerCounters counters_;
};

}  // namespace loopwarden::daemon::gateway
