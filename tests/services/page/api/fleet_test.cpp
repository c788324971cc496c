// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/services/page/support/api_rig.hpp"

namespace loopwarden::tests::fleet_test {

using http::Request;
using nlohmann::json;

json session_of(ApiRig& rig) {
  return json::parse(rig.answer(ApiRig::get({"api", "session"})).body);
}

TEST_CASE("the plant is requested by group, and a valve by its names") {
  ApiRig rig(true);
  rig.has_fleet = true;
  Request request = rig.get_as("vera", {"api", "fleet"});
  request.query["group"] = "North";
  const auto answer = rig.answer(request);
  CHECK(answer.status == 200);
  CHECK(answer.text() == R"({"group":"North"})");
  CHECK(rig.answer(rig.get_as("vera", {"api", "fleet", "valves", "A", "box 1", "F_1"})).status ==
        200);
  CHECK(rig.answer(rig.get_as("vera", {"api", "fleet", "valves", "A", "b", "none"})).status == 404);
  CHECK(rig.fleet.asked == std::vector<std::string>{"North", "A|box 1|F_1", "A|b|none"});
  request.query["grup"] = "x";
  CHECK(rig.answer(request).status == 400);
  request.query = {{"group", std::string(201, 'x')}};
  CHECK(rig.answer(request).status == 400);
}

TEST_CASE("the plant needs a log-in, and never waits for the daemon's pools") {
  ApiRig rig(true);
  rig.has_fleet = true;
  for (const std::vector<std::string>& path :
       {std::vector<std::string>{"api", "fleet"}, {"api", "fleet", "valves", "A", "b", "c"}}) {
    CHECK(rig.answer(ApiRig::get(path)).status == 401);
    CHECK(rig.router().pool(ApiRig::get(path)) == http::Pool::fleet);
    CHECK(rig.answer(rig.post_as("ella", path, json::object())).status == 405);
  }
  CHECK(rig.fleet.asked.empty());
}

TEST_CASE("an unavailable database gives 503 with its error, and with the last answer") {
  ApiRig rig(false);
  rig.has_fleet = true;
  rig.fleet.why_down = "no \"route\"";
  const Request request = ApiRig::get({"api", "fleet"});
  auto answer = rig.answer(request);
  CHECK(answer.status == 503);
  CHECK(json::parse(answer.body) == json{{"error", "no \"route\""}});
  rig.fleet.last = std::make_shared<const std::string>(R"({"group":"","now_ms":5})");
  answer = rig.answer(request);
  CHECK(answer.status == 503);
  CHECK(json::parse(answer.body) ==
        json{{"error", "no \"route\""}, {"last", {{"group", ""}, {"now_ms", 5}}}});
  CHECK(rig.answer(ApiRig::get({"api", "fleet", "valves", "A", "b", "c"})).status == 503);
}

TEST_CASE("without the section fleet the page shows no fleet") {
  ApiRig rig(false);
  CHECK(rig.answer(ApiRig::get({"api", "fleet"})).status == 404);
  CHECK(session_of(rig)["fleet"] == false);
  CHECK(session_of(rig)["box"] == true);
  CHECK(rig.answer(ApiRig::get({"api", "alarms"})).status == 200);
}

TEST_CASE("on a machine without a daemon the box's addresses give 404") {
  ApiRig rig(true);
  rig.has_fleet = true;
  rig.settings.box = false;
  CHECK(session_of(rig)["fleet"] == true);
  CHECK(session_of(rig)["box"] == false);
  for (const std::vector<std::string>& path : {std::vector<std::string>{"api", "alarms"},
                                               {"api", "describe"},
                                               {"api", "events"},
                                               {"api", "journal"},
                                               {"api", "reports"},
                                               {"api", "loops", "FIC-101"},
                                               {"reports", "x"}}) {
    CAPTURE(path);
    CHECK(rig.answer(rig.get_as("vera", path)).status == 404);
    CHECK(rig.answer(ApiRig::get(path)).status == 401);
  }
  CHECK(rig.answer(rig.post_as("otto", {"api", "loops", "FIC-101", "alarms", "stiction"},
                               {{"action", "acknowledge"}}))
            .status == 404);
  CHECK(rig.answer(rig.get_as("vera", {"api", "fleet"})).status == 200);
}

}  // namespace loopwarden::tests::fleet_test
