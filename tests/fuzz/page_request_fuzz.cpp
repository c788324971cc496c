// SPDX-License-Identifier: Apache-2.0
// A browser that sends any request with any user's cookie to every handler. The input also gives
// the daemon's answers. Each answer must have a known status and a complete head, and JSON must be
// valid. Users without the right must not send commands.
//
// The input is text (tests/fuzz/corpus/page_request). It has these parts:
// - the user, and "token" if the user sends the right CSRF token
// - the request in the form of HTTP
// - a line "----"
// - the answers of the daemon, one per line
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "services/net/http/request_head.hpp"
#include "services/net/http/response_head.hpp"
#include "tests/services/page/support/api_rig.hpp"

namespace {

using namespace loopwarden;
using http::RequestHead;
using nlohmann::json;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not kept: %s\n", what);
  std::abort();
}

// Removes and returns the text before `end`, and removes `end`. Without `end`, returns all of the
// text.
std::string take(std::string_view& text, std::string_view end) {
  const std::size_t at = std::min(text.find(end), text.size());
  std::string taken(text.substr(0, at));
  text.remove_prefix(std::min(at + end.size(), text.size()));
  return taken;
}

RequestHead head_from(std::string_view& input) {
  std::string line = take(input, "\n");
  std::string_view words = line;
  RequestHead head{take(words, " "), take(words, " "), {}};
  for (line = take(input, "\n"); !line.empty(); line = take(input, "\n")) {
    std::string_view field = line;
    const std::string name = take(field, ": ");
    head.fields.emplace_back(name, field);
  }
  return head;
}

// The daemon answers with any text, which is rarely a valid answer.
json answer_from(std::string_view& input) {
  const std::string line = take(input, "\n");
  json answer = json::parse(line, nullptr, false);
  if (!answer.is_object()) throw protocol::DaemonError(protocol::DaemonError::Kind::refused, line);
  return answer;
}

// A page with users and rights, shared by all inputs, so that their effects on sessions and
// attempts are tested too.
tests::ApiRig& rig() {
  static tests::ApiRig one(true);
  static const bool filled = [] {
    one.has_fleet = true;
    tests::write_file(one.folder / "state/evidence/one/evidence.json", "{}");
    tests::write_file(one.folder / "state/evidence/one/record.csv", "time,pv\n0,1\n1,2\n");
    tests::write_file(one.folder / "state/evidence/one/report.html", "<title>Gap</title>");
    return true;
  }();
  (void)filled;
  return one;
}

void check(const http::Request& request, http::Response& response) {
  static const std::set<int> kKnown{200, 302, 304, 400, 401, 403, 404,
                                    405, 409, 413, 415, 429, 500, 503};
  require(kKnown.contains(response.status), "a known status");
  const std::string head = http::head_text(response, {});
  require(head.ends_with("\r\n\r\n") && head.find("\r\n\r\n") == head.size() - 4, "one head");
  require(head.find("Content-Security-Policy: ") != std::string::npos, "a policy");
  if (response.content_type == "application/json" && !response.text().empty()) {
    require(json::accept(response.text()), "JSON");
  }
  for (int i = 0; response.source && i < 5; ++i) {
    try {
      if (response.source->next().empty()) break;
    } catch (const std::exception&) {
      break;  // the connection ends
    }
  }
  if (response.may_stay) response.may_stay();
  require(request.method == http::Method::post || rig().orders.asked.empty(), "only POST orders");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view input(reinterpret_cast<const char*>(data), size);
  const std::string who = take(input, "\n");
  std::string_view words = who;
  const std::string user = take(words, " ");
  const bool knows_token = words == "token";
  const RequestHead head = head_from(input);
  if (http::refusal_of(head)) return 0;
  tests::ApiRig& all = rig();
  http::Request request = http::request_of(head);
  request.peer = "10.0.0.1";
  request.body = take(input, "\n----\n");
  if (request.body.size() > http::kMostBodyBytes) return 0;
  const http::Request known = all.post_as(user, {}, {});
  if (!user.empty()) request.cookies = known.cookies;
  if (knows_token) {
    request.csrf = known.csrf;
    request.content_type = "application/json";
  }
  const auto answers = [&input](const json&) { return answer_from(input); };
  all.daemon.says = answers;
  all.orders.says = answers;
  all.daemon.asked.clear();
  all.orders.asked.clear();
  all.fleet.asked.clear();
  http::Response response = all.answer(request);
  check(request, response);
  const bool may_order = knows_token && (user == "otto" || user == "ella");
  require(may_order || all.orders.asked.empty(), "who may not does not order");
  return 0;
}
