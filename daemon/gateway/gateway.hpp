// SPDX-License-Identifier: Apache-2.0
// The Modbus server's thread: connections, the register map, and supervision of the master.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "daemon/gateway/map_bank.hpp"
#include "daemon/gateway/master_watch.hpp"
#include "daemon/gateway/modbus_answer.hpp"
#include "daemon/gateway/loops_view.hpp"
#include "daemon/gateway/serial_server.hpp"
#include "daemon/gateway/tcp_server.hpp"
#include "base/clock.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon::gateway {

struct GatewaySettings {
  TcpServerSettings tcp;
  std::vector<base::PeerRule> peers;
  bool writes = false;  // false: no client may write, whatever its rule
  hal::modbus::ByteOrder word_order = hal::modbus::ByteOrder::abcd;
  MasterHeartbeatSettings master_heartbeat;
  std::optional<SerialServerSettings> serial;
};

class Gateway {
 public:
  // Listens at once, serves from start() on.
  Gateway(const GatewaySettings& settings, LoopsView& loops, base::Clock& clock);
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;
  ~Gateway() { stop(); }

  void start();
  void stop();

  // Serves one round. Public for tests.
  void serve(std::chrono::milliseconds timeout);

  std::uint16_t port() const noexcept { return server_.port(); }
  // Returns why no client can connect; empty: clients can. From any thread.
  std::string problem() const { return server_.problem(); }
  TcpServerCounters counters() const;  // from any thread
  std::optional<SerialServerCounters> serial_counters()
      const;                  // from any thread; nullopt without a serial line
  ServerState state() const;  // from any thread; state of the last round
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

 private:
  Reply reply(std::span<const std::uint8_t> request, const Peer& peer);
  void watch_master();
  void write_down_loss(const char* what);

  LoopsView& loops_;
  base::Clock& clock_;
  MasterHeartbeatSettings master_;
  MasterWatch master_watch_;
  ServerState state_;
  MapBank bank_;
  DeviceIdentity identity_;
  TcpServer server_;
  std::unique_ptr<SerialServer> serial_;  // null: not configured
  mutable std::mutex counters_mutex_;
  TcpServerCounters counters_;
  std::optional<SerialServerCounters> serial_counters_;
  ServerState shown_state_;
  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::gateway
