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

  // `address` is numeric; port 0: any. `text` is called on a thread of the endpoint's own. Throws std::runtime_error
  // if it can't listen there.
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
