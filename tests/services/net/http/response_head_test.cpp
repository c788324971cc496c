// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/response_head.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::response_head_test {

using namespace http;
using Catch::Matchers::Contains;

TEST_CASE("every answer has the security headers for browsers") {
  const std::string head = head_text(Response(), {});
  CHECK_THAT(head, Contains("Content-Security-Policy: default-src 'none'; script-src 'self';"));
  CHECK_THAT(head, Contains("X-Content-Type-Options: nosniff\r\n"));
  CHECK_THAT(head, Contains("Referrer-Policy: no-referrer\r\n"));
  CHECK_THAT(head, Contains("Cross-Origin-Opener-Policy: same-origin\r\n"));
  CHECK_THAT(head, Contains("Cross-Origin-Resource-Policy: same-origin\r\n"));
  CHECK_THAT(head, Contains("Cache-Control: no-store\r\n"));
  CHECK_THAT(head, !Contains("Strict-Transport-Security"));
  CHECK_THAT(head_text(Response(), {.secure = true}), Contains("Strict-Transport-Security"));
}

TEST_CASE("a header of the answer replaces the default one") {
  Response response;
  response.headers.emplace_back("Cache-Control", "no-cache");
  const std::string head = head_text(response, {});
  CHECK_THAT(head, Contains("Cache-Control: no-cache\r\n"));
  CHECK_THAT(head, !Contains("no-store"));
}

TEST_CASE("a line break in a value adds no header") {
  Response response;
  response.headers.emplace_back("X-Name", "a\r\nSet-Cookie: lw_session=stolen");
  CHECK_THAT(head_text(response, {}), !Contains("Set-Cookie"));
}

TEST_CASE("the length of a body is sent, that of a source is unknown") {
  Response response;
  response.body = "12345";
  CHECK_THAT(head_text(response, {}), Contains("Content-Length: 5\r\n"));
  response.may_stay = [] { return true; };
  CHECK_THAT(head_text(response, {}), !Contains("Content-Length"));
}

TEST_CASE("an error is JSON with any bytes") {
  CHECK(error_response(400, "bad \xff \" x", "set").body ==
        "{\"error\":\"bad \xef\xbf\xbd \\\" x\",\"field\":\"set\"}");
}

}  // namespace loopwarden::tests::response_head_test
