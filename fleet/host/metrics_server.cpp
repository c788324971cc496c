// SPDX-License-Identifier: Apache-2.0
#include "fleet/host/metrics_server.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <stdexcept>
#include <utility>

#include "hal/os/thread.hpp"

namespace loopwarden::fleet {

struct MetricsEndpoint::Server {
  httplib::Server http;
  hal::os::Thread thread;
};

MetricsEndpoint::MetricsEndpoint(const std::string& address, std::uint16_t port, Text text) {
  if (port == 0) return;
  server_ = std::make_unique<Server>();
  httplib::Server& http = server_->http;
  http.new_task_queue = [] { return new httplib::ThreadPool(2); };  // httplib deletes it
  http.set_payload_max_length(1024);
  http.Get("/metrics",
           [text = std::move(text)](const httplib::Request&, httplib::Response& answer) {
             answer.set_content(text(), "text/plain; version=0.0.4; charset=utf-8");
           });
  if (!http.bind_to_port(address, port)) {
    throw std::runtime_error(fmt::format("metrics: {}:{} can't be listened at", address, port));
  }
  server_->thread.start({.name = "lw-metrics", .stack_bytes = 1024UL * 1024UL},
                        [this] { server_->http.listen_after_bind(); });
}

MetricsEndpoint::~MetricsEndpoint() {
  if (!server_) return;
  server_->http.stop();
  server_->thread.join();
}

}  // namespace loopwarden::fleet
