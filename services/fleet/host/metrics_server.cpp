// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/metrics_server.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "base/thread.hpp"
#include "services/net/http/server.hpp"

namespace loopwarden::fleet {

namespace http = http;

namespace {

// Answers are in memory, so only the loop's thread is needed.
http::ServerSettings without_pools() {
  http::ServerSettings settings;
  settings.pools = {};
  return settings;
}

}  // namespace

struct MetricsEndpoint::Server : http::Handler {
  explicit Server(Text wanted) : text(std::move(wanted)) {}
  ~Server() override {
    server.stop();
    thread.join();
  }

  http::Pool pool(const http::Request&) const noexcept override { return http::Pool::here; }
  http::Response answer(const http::Request& request) noexcept override {
    http::Response response;
    response.content_type = "text/plain; version=0.0.4; charset=utf-8";
    const bool reads = request.method == http::Method::get || request.method == http::Method::head;
    if (request.path.size() != 1 || request.part(0) != "metrics") {
      response.status = 404;
    } else if (!reads) {
      response.status = 405;
    } else {
      fill(response);
    }
    return response;
  }

  void fill(http::Response& response) noexcept {
    try {
      response.body = text();
    } catch (const std::exception& e) {
      spdlog::error("metrics: {}", e.what());
      response.status = 500;
    }
  }

  Text text;
  http::Server server{without_pools(), *this};
  base::Thread thread;
};

MetricsEndpoint::MetricsEndpoint(const std::string& address, std::uint16_t port, Text text) {
  server_ = std::make_unique<Server>(std::move(text));
  port_ = server_->server.listen(address, port);
  server_->thread.start({.name = "lw-metrics", .stack_bytes = 1024UL * 1024UL},
                        [this] { server_->server.run(); });
}

MetricsEndpoint::~MetricsEndpoint() = default;

}  // namespace loopwarden::fleet
