// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/metrics_server.hpp"

#include <catch2/catch.hpp>

#include <stdexcept>
#include <string>

#include "tests/services/page/support/raw_client.hpp"

namespace loopwarden::metrics_server_test {
namespace {

using fleet::MetricsEndpoint;

std::string answer(const MetricsEndpoint& endpoint, const std::string& line) {
  tests::RawClient client(endpoint.port());
  client.send(line + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  return client.rest();
}

TEST_CASE("/metrics is in Prometheus' format, made for each request, and the only page") {
  int asked = 0;
  const MetricsEndpoint endpoint("127.0.0.1", 0, [&asked] {
    ++asked;
    return "asked " + std::to_string(asked) + "\n";
  });
  const std::string first = answer(endpoint, "GET /metrics");
  CHECK_THAT(first, Catch::StartsWith("HTTP/1.1 200") && Catch::EndsWith("\r\n\r\nasked 1\n"));
  CHECK_THAT(first, Catch::Contains("text/plain; version=0.0.4; charset=utf-8"));
  CHECK_THAT(answer(endpoint, "GET /metrics?name=x"), Catch::EndsWith("asked 2\n"));
  CHECK_THAT(answer(endpoint, "HEAD /metrics"),
             Catch::StartsWith("HTTP/1.1 200") && Catch::EndsWith("\r\n\r\n"));
  CHECK_THAT(answer(endpoint, "GET /"), Catch::StartsWith("HTTP/1.1 404"));
  CHECK_THAT(answer(endpoint, "GET /metrics/x"), Catch::StartsWith("HTTP/1.1 404"));
  CHECK_THAT(answer(endpoint, "POST /metrics"), Catch::StartsWith("HTTP/1.1 405"));
}

TEST_CASE("unavailable metrics are reported as such, and the next ones are sent") {
  bool broken = true;
  const MetricsEndpoint endpoint("127.0.0.1", 0, [&broken]() -> std::string {
    if (broken) throw std::runtime_error("none");
    return "all\n";
  });
  CHECK_THAT(answer(endpoint, "GET /metrics"), Catch::StartsWith("HTTP/1.1 500"));
  broken = false;
  CHECK_THAT(answer(endpoint, "GET /metrics"), Catch::EndsWith("all\n"));
}

TEST_CASE("a port in use is an error") {
  const auto text = [] { return std::string(); };
  const MetricsEndpoint first("127.0.0.1", 0, text);
  CHECK_THROWS_WITH(MetricsEndpoint("127.0.0.1", first.port(), text),
                    Catch::Contains("can't listen at 127.0.0.1 port"));
}

}  // namespace
}  // namespace loopwarden::metrics_server_test
