// SPDX-License-Identifier: Apache-2.0
// Modbus TCP connections: a poll() loop that never blocks on a client.
//
// An answer that waits for something (Reply::ready) keeps its client waiting, and nobody else: what the client sends
// behind it stays in its socket.
//
// What one client can do to the others is bounded: a frame that is none ends its connection; a client
// that sends slowly costs a buffer; one that does not read its answers is not read from; one that asks
// too often waits. When all places are taken, the one goes that never sent a sound request, else the
// one whose last is longest ago.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/gateway/modbus_answer.hpp"
#include "base/peer_list.hpp"
#include "base/clock.hpp"

namespace loopwarden::daemon::gateway {

struct TcpServerSettings {
  std::string address = "127.0.0.1";
  std::uint16_t port = 1502;  // 0: any, see port()
  std::uint8_t unit = 1;      // 0 and 255 are answered as well, as TCP devices do
  std::size_t most_clients = 32;
  double idle_timeout_s = 60.0;        // s without a sound request
  double requests_per_second = 200.0;  // of each client
  int listener = -1;  // a listening socket to take over; then address and port don't matter
};

struct TcpServerCounters {
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;    // not on the list
  std::uint64_t displaced = 0;  // to make room
  std::uint64_t malformed = 0;  // connections ended for what they sent
  std::uint64_t requests = 0;
  std::size_t clients = 0;
};

class TcpServer {
 public:
  using Answer = std::function<Reply(std::span<const std::uint8_t> request, const Peer& peer)>;

  // Listens. Throws std::runtime_error.
  TcpServer(TcpServerSettings settings, base::PeerList peers, base::Clock& clock, Answer answer);
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  ~TcpServer();

  // Serves what is there, waiting at most `timeout` for it.
  // `also`: a descriptor that ends the waiting when it has something to read; -1: none.
  void serve(std::chrono::milliseconds timeout, int also = -1);

  std::uint16_t port() const noexcept { return port_; }
  // What had come before this time is read, but for clients who wait for an answer, ask too often or sent more than
  // the server takes in a round.
  std::int64_t read_ns() const noexcept { return read_ns_; }
  const TcpServerCounters& counters() const noexcept { return counters_; }

 private:
  void listen_at_address();
  static constexpr std::size_t kMostFrame = 260;
  struct Client {
    int fd = -1;
    Peer peer;
    std::array<std::uint8_t, kMostFrame> received{};
    std::size_t received_size = 0;
    std::array<std::uint8_t, kMostFrame> to_send{};
    std::size_t to_send_size = 0;
    std::size_t sent = 0;
    std::function<bool()> ready;       // of an answer that waits; empty: none
    std::int64_t last_request_ns = 0;  // or when it came
    bool asked = false;                // has sent a sound request
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
  // Bytes of the first frame in the buffer; 0: not there yet; nullopt: it is no frame.
  static int frame_size(const Client& client);

  TcpServerSettings settings_;
  base::PeerList peers_;
  base::Clock& clock_;
  Answer answer_;
  int listener_ = -1;
  std::int64_t accept_again_ns_ = 0;
  std::int64_t read_ns_ = 0;
  std::uint16_t port_ = 0;
  std::vector<Client> clients_;
  TcpServerCounters counters_;
};

}  // namespace loopwarden::daemon::gateway
