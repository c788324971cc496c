// SPDX-License-Identifier: Apache-2.0
// A browser that asks for anything, with anybody's cookie: every handler, on a daemon whose answers are drawn from the
// input as well. Whatever comes, there is an answer with a known status, its head is whole, what is JSON is JSON, and nobody orders
// who may not.
#include <fuzzer/FuzzedDataProvider.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "page/http/request_head.hpp"
#include "page/http/response_head.hpp"
#include "tests/page/support/api_rig.hpp"

namespace {

using namespace loopwarden;
using nlohmann::json;
using page::http::RequestHead;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not kept: %s\n", what);
  std::abort();
}

// What leads somewhere, for the fuzzer to find its way.
constexpr std::array kPaths{"/",
                            "/api/session",
                            "/api/describe",
                            "/api/events",
                            "/api/sparklines",
                            "/api/alarms",
                            "/api/system",
                            "/api/loops/FIC-101",
                            "/api/loops/FIC-101/windows",
                            "/api/loops/FIC-101/history",
                            "/api/loops/FIC-101/history.csv",
                            "/api/loops/FIC-101/alarms/stiction",
                            "/api/loops/FIC-101/order",
                            "/api/journal",
                            "/api/journal.csv",
                            "/api/evidence/one",
                            "/api/reports",
                            "/api/login",
                            "/api/logout",
                            "/reports/"};
constexpr std::array kMethods{"GET", "POST", "HEAD", "PUT", "OPTIONS"};
constexpr std::array kUsers{"", "vera", "otto", "ella", "nobody"};
constexpr std::array kFields{"Cookie",       "X-CSRF-Token",  "Origin",          "Sec-Fetch-Site",
                             "Content-Type", "If-None-Match", "Accept-Encoding", "Content-Length",
                             "Host",         "X-Other"};

RequestHead head_from(FuzzedDataProvider& input) {
  RequestHead head{kMethods[input.ConsumeIntegralInRange<std::size_t>(0, kMethods.size() - 1)],
                   kPaths[input.ConsumeIntegralInRange<std::size_t>(0, kPaths.size() - 1)],
                   {}};
  head.target += input.ConsumeRandomLengthString(200);
  if (input.ConsumeIntegralInRange(0, 7) != 7) head.fields.emplace_back("Host", "localhost:8480");
  for (int n = input.ConsumeIntegralInRange(0, 4); n > 0; --n) {
    head.fields.emplace_back(
        kFields[input.ConsumeIntegralInRange<std::size_t>(0, kFields.size() - 1)],
        input.ConsumeRandomLengthString(100));
  }
  return head;
}

// The daemon says what it likes; most of it is no answer to what was asked.
json answer_from(FuzzedDataProvider& input) {
  json answer = json::parse(input.ConsumeRandomLengthString(300), nullptr, false);
  if (!answer.is_object()) throw page::DaemonRefused(input.ConsumeRandomLengthString(50));
  return answer;
}

// With rights of its own, once for all inputs: what they do to sessions and tries is part of it.
tests::ApiRig& rig() {
  static tests::ApiRig one(true);
  static const bool filled = [] {
    tests::write_file(one.folder / "state/evidence/one/evidence.json", "{}");
    tests::write_file(one.folder / "state/evidence/one/record.csv", "time,pv\n0,1\n1,2\n");
    tests::write_file(one.folder / "state/evidence/one/report.html", "<title>Gap</title>");
    return true;
  }();
  (void)filled;
  return one;
}

void check(const page::http::Request& request, page::http::Response& response) {
  static const std::set<int> kKnown{200, 302, 304, 400, 401, 403, 404,
                                    405, 409, 413, 415, 429, 500, 503};
  require(kKnown.contains(response.status), "a known status");
  const std::string head = page::http::head_text(response, {});
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
  require(request.method == page::http::Method::post || rig().orders.asked.empty(),
          "only POST orders");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const std::string user = kUsers[input.ConsumeIntegralInRange<std::size_t>(0, kUsers.size() - 1)];
  const bool knows_token = input.ConsumeBool();
  RequestHead head = head_from(input);
  if (page::http::refusal_of(head)) return 0;
  tests::ApiRig& all = rig();
  page::http::Request request = page::http::request_of(head);
  request.peer = "10.0.0.1";
  const page::http::Request known = all.post_as(user, {}, {});
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
  request.body = input.ConsumeRandomLengthString(page::http::kMostBodyBytes);
  page::http::Response response = all.answer(request);
  check(request, response);
  const bool may_order = knows_token && (user == "otto" || user == "ella");
  require(may_order || all.orders.asked.empty(), "who may not does not order");
  return 0;
}
