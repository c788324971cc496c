// SPDX-License-Identifier: Apache-2.0
// GET /metrics over HTTP, for Prometheus. Meant for the machine itself or a network of its own: no TLS, no users.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace loopwarden::fleet {

class MetricsEndpoint {
 public:
  using Text = std::function<std::string()>;

  // Port 0: none. Throws std::runtime_error where the port can't be had.
  MetricsEndpoint(const std::string& address, std::uint16_t port, Text text);
  MetricsEndpoint(const MetricsEndpoint&) = delete;
  MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;
  ~MetricsEndpoint();

 private:
  struct Server;
  std::unique_ptr<Server> server_;
};

}  // namespace loopwarden::fleet
