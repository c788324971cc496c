// SPDX-License-Identifier: Apache-2.0
// Which clients may hold a connection, and whose is closed to make room for a new one. No sockets, no clock of its own;
// one thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace loopwarden::http {

using Moment = std::chrono::steady_clock::time_point;

struct ClientLimits {
  std::size_t clients = 200;     // connections in all
  std::size_t per_address = 50;  // of one address that is not this host's own
  std::size_t loopback = 100;    // of this host itself, where a proxy may stand
  double requests_per_s = 50.0;  // of one address, on average; bursts of four seconds
};

class AdmissionControl {
 public:
  explicit AdmissionControl(ClientLimits limits) : limits_(limits) {}

  struct Admission {
    std::uint64_t id = 0;                                   // 0: there is no room
    std::optional<std::uint64_t> displaced = std::nullopt;  // whose connection is to be closed
  };
  // If all places are taken, the oldest connection that never sent a sound request is displaced, else the one that has
  // been silent for longest; never one whose request is being answered.
  Admission admit(const std::string& address, bool loopback, Moment now);
  void left(std::uint64_t id);

  // A request of this connection is being answered, or the connection waits for the next one.
  void busy(std::uint64_t id);
  void idle(std::uint64_t id, Moment now);

  // False: this connection may not become a stream. Streams have three quarters of all places and of those of an address, so that
  // who only asks always finds one.
  bool stream(std::uint64_t id);

  // 0 if a request of this address may be answered, else after how many seconds it may be repeated (Retry-After).
  unsigned retry_after_s(const std::string& address, Moment now);

  std::size_t clients() const noexcept { return clients_.size(); }
  std::uint64_t displaced() const noexcept { return displaced_; }
  std::uint64_t turned_away() const noexcept { return turned_away_; }

 private:
  struct Client {
    std::string address;
    Moment silent_since;
    bool loopback = false;
    bool served = false;
    bool busy = false;
    bool stream = false;
  };
  struct Bucket {
    double tokens = 0.0;
    Moment at;
  };
  std::size_t most_of(bool loopback) const noexcept {
    return loopback ? limits_.loopback : limits_.per_address;
  }
  std::optional<std::uint64_t> displaceable(const std::string* address) const;
  void forget_full_buckets(Moment now);

  ClientLimits limits_;
  std::map<std::uint64_t, Client> clients_;  // by age
  std::map<std::string, std::size_t> by_address_;
  std::map<std::string, Bucket> buckets_;
  std::uint64_t next_ = 1;
  std::uint64_t displaced_ = 0;
  std::uint64_t turned_away_ = 0;
};

}  // namespace loopwarden::http
