// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/assets.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::assets_test {

using namespace http;

std::string header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return {};
}

Assets some() {
  Assets assets;
  assets.add("index.html", std::string(5000, 'a'));
  assets.add("lib/live.js", "x");
  assets.add("icon.png", std::string("\0\1\2", 3));
  return assets;
}

Request wants(std::vector<std::string> path) {
  Request request;
  request.path = std::move(path);
  return request;
}

TEST_CASE("the site's files have path, type and size") {
  const Assets assets = some();
  CHECK(assets.answer(wants({})).content_type == "text/html; charset=utf-8");
  CHECK(assets.answer(wants({"lib", "live.js"})).content_type == "text/javascript; charset=utf-8");
  CHECK(assets.answer(wants({"icon.png"})).text() == std::string_view("\0\1\2", 3));
  CHECK(assets.answer(wants({"lib"})).status == 404);
}

TEST_CASE("a file that the client has is not sent again") {
  const Assets assets = some();
  Request request = wants({});
  const std::string tag = header(assets.answer(request), "ETag");
  REQUIRE_FALSE(tag.empty());
  request.if_none_match = "\"other\", " + tag;
  const Response again = assets.answer(request);
  CHECK(again.status == 304);
  CHECK(again.text().empty());
}

TEST_CASE("gzip is used only if it is accepted and makes the file smaller") {
  const Assets assets = some();
  Request request = wants({});
  CHECK(header(assets.answer(request), "Content-Encoding").empty());
  request.accepts_gzip = true;
  const Response packed = assets.answer(request);
  CHECK(header(packed, "Content-Encoding") == "gzip");
  CHECK(packed.text().size() < 100);
  CHECK(packed.text().substr(0, 2) == "\x1f\x8b");
  request.path = {"lib", "live.js"};
  CHECK(header(assets.answer(request), "Content-Encoding").empty());
}

}  // namespace loopwarden::tests::assets_test
