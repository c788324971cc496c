// SPDX-License-Identifier: Apache-2.0
// Serves GET /metrics over HTTP for Prometheus. It has no TLS and no users: use it only on the host
// itself or in a separate network.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace loopwarden::fleet {

class MetricsEndpoint {
 public:
  using Text = std::function<std::string()>;

  // Listens on the numeric `address`. Port 0: any free port. `text` is called on the endpoint's
  // thread. Throws std::runtime_error if it can't listen.
  MetricsEndpoint(const std::string& address, std::uint16_t port, Text text);
  MetricsEndpoint(const MetricsEndpoint&) = delete;
  MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;
  ~MetricsEndpoint();

  std::uint16_t port() const noexcept { return port_; }

 private:
  struct Server;
  std::unique_ptr<Server> server_;
  std::uint16_t port_ = 0;
};

}  // namespace loopwarden::fleet
