// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/request_head.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::request_head_test {

using namespace http;
using Strings = std::vector<std::string>;

RequestHead get(const std::string& target) { return {"GET", target, {{"Host", "localhost:8480"}}}; }

int status_of(const RequestHead& head) {
  const auto refusal = refusal_of(head);
  return refusal ? refusal->status : 200;
}

RequestHead with(RequestHead head, const std::string& name, const std::string& value) {
  head.fields.emplace_back(name, value);
  return head;
}

TEST_CASE("a target is split into path and query") {
  const Request request =
      request_of(get("/api/loops/FIC%2D101/history?from_ms=5&text=a+b%26c&empty"));
  CHECK(request.path == Strings{"api", "loops", "FIC-101", "history"});
  CHECK(request.query.at("from_ms") == "5");
  CHECK(request.query.at("text") == "a b&c");
  CHECK(request.query.at("empty").empty());
  CHECK(request_of(get("/")).path.empty());
}

TEST_CASE("no path leaves its folder") {
  const char* const target =
      GENERATE("/../etc/passwd", "/a/../../b", "/%2e%2e/x", "/a/%2E%2E", "/a%2fb", "/a/%5c..%5cb",
               "/.", "//etc/passwd", "/a//b", "/a%00b", "/a%0d%0aSet-Cookie:x", "/%", "/%2", "/%zz",
               "*", "http://evil/", "a");
  CAPTURE(target);
  CHECK(status_of(get(target)) == 400);
}

TEST_CASE("a query with a control character or half an escape is refused") {
  CHECK(status_of(get("/x?a=%0a")) == 400);
  CHECK(status_of(get("/x?a=%1")) == 400);
  CHECK(status_of(get("/x?" + std::string(5000, 'a'))) == 414);
}

TEST_CASE("a request names one host") {
  CHECK(status_of({"GET", "/", {}}) == 400);
  CHECK(status_of(with(get("/"), "host", "other")) == 400);
}

TEST_CASE("requests that allow smuggling are refused") {
  const RequestHead post{"POST", "/api/login", {{"Host", "localhost"}}};
  CHECK(status_of(with(post, "Transfer-Encoding", "chunked")) == 411);
  CHECK(status_of(with(with(post, "Content-Length", "5"), "transfer-encoding", "identity")) == 411);
  CHECK(status_of(with(with(post, "Content-Length", "5"), "content-length", "5")) == 400);
  CHECK(status_of(with(post, "Content-Length", "+5")) == 400);
  CHECK(status_of(with(post, "Content-Length", "5, 5")) == 400);
  CHECK(status_of(with(post, "Content-Length", "0x5")) == 400);
  CHECK(status_of(with(post, "Content-Length", "1073741824")) == 413);
  CHECK(status_of(with(post, "Content-Length", "99999999999999999999999")) == 413);
  CHECK(status_of(with(post, "Expect", "100-continue")) == 417);
  CHECK(status_of(with(with(post, "Expect", "100-continue"), "Content-Length", "5")) == 417);
  CHECK(status_of(with(with(post, "Expect", "100-continue"), "Content-Length", "5000000")) == 413);
  CHECK(status_of(with(post, "Content-Length", "65536")) == 200);
  CHECK(status_of(with(get("/"), "Content-Length", "5")) == 400);
}

TEST_CASE("cookies and fields are read in any case of letters") {
  RequestHead head = get("/");
  head = with(head, "COOKIE", "a=1; lw_session=abc ;b=2=3");
  head = with(head, "x-csrf-token", " token ");
  head = with(head, "Content-Type", "Application/JSON; charset=utf-8");
  const Request request = request_of(head);
  CHECK(request.cookies.at("lw_session") == "abc");
  CHECK(request.cookies.at("b") == "2=3");
  CHECK(request.csrf == "token");
  CHECK(request.content_type == "application/json");
}

TEST_CASE("a request is from a person only if it is marked so") {
  CHECK(request_of(with(get("/"), "X-Loopwarden-Person", "1")).person);
  CHECK_FALSE(request_of(with(get("/"), "X-Loopwarden-Person", "0")).person);
  CHECK_FALSE(request_of(get("/")).person);
}

TEST_CASE("gzip is used if it is accepted") {
  const auto accepts = [](const std::string& value) {
    return request_of(with(get("/"), "Accept-Encoding", value)).accepts_gzip;
  };
  CHECK(accepts("deflate, GZIP;q=0.5"));
  CHECK(accepts("gzip"));
  CHECK_FALSE(accepts("gzip;q=0"));
  CHECK_FALSE(accepts("br"));
}

}  // namespace loopwarden::tests::request_head_test
