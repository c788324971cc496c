// SPDX-License-Identifier: Apache-2.0
// Decides which clients may hold a connection, and which connection is closed to make room for a
// new one. It uses no sockets and no clock. For one thread only.
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
  std::size_t per_address = 50;  // connections of one address other than this host
  std::size_t loopback = 100;    // connections of this host, for example of a proxy
  double requests_per_s = 50.0;  // per address, on average; bursts of twenty seconds
};

class AdmissionControl {
 public:
  explicit AdmissionControl(ClientLimits limits) : limits_(limits) {}

  struct Admission {
    std::uint64_t id = 0;                                   // 0: no place is free
    std::optional<std::uint64_t> displaced = std::nullopt;  // connection to be closed
  };
  // Admits a connection. If all places are taken, it displaces the oldest connection that never
  // sent a valid request. Without such a connection it displaces the one that has been silent
  // longest. A connection whose request is being answered is never displaced.
  Admission admit(const std::string& address, bool loopback, Moment now);
  void left(std::uint64_t id);

  // A request of this connection is being answered (busy), or the connection waits for the next one
  // (idle).
  void busy(std::uint64_t id);
  void idle(std::uint64_t id, Moment now);

  // Turns a connection into a stream. Returns false if the limit of streams is reached. Streams may
  // use three quarters of all places and of the places of an address, so that requests always find
  // a place.
  bool stream(std::uint64_t id);

  // Returns 0 if a request of this address may be answered. Otherwise returns the seconds after
  // which it may be repeated (Retry-After).
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
  std::map<std::uint64_t, Client> clients_;  // by id: oldest first
  std::map<std::string, std::size_t> by_address_;
  std::map<std::string, Bucket> buckets_;
  std::uint64_t next_ = 1;
  std::uint64_t displaced_ = 0;
  std::uint64_t turned_away_ = 0;
};

}  // namespace loopwarden::http
