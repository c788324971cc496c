// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/services/page/support/api_rig.hpp"
#include "tests/services/page/tuning/recorded_loop.hpp"

namespace loopwarden::tests::router_test {

using http::Method;
using http::Pool;
using http::Request;
using nlohmann::json;

const json kAcknowledge{{"action", "acknowledge"}};
const std::vector<std::string> kAlarm{"api", "loops", "FIC-101", "alarms", "stiction"};
const std::vector<std::string> kOrder{"api", "loops", "FIC-101", "order"};
const std::vector<std::string> kTuning{"api", "loops", "FIC-101", "tuning"};

json set_point(double value, double old) {
  return {{"set", {{"set_point", value}}},
          {"confirm", {{"tag", "FIC-101"}, {"old", old}, {"new", value}}}};
}

// Declares sections in which a command is confirmed for another loop, or is not confirmed.
bool spoils_confirmation(json& order) {
  SECTION("another tag") {
    order["confirm"]["tag"] = "FIC-102";
    return true;
  }
  SECTION("no confirmation") {
    order.erase("confirm");
    return true;
  }
  return false;
}

TEST_CASE("without users everybody on this host can view and not write") {
  ApiRig rig(false);
  Request request = ApiRig::get({"api", "session"});
  const json session = json::parse(rig.answer(request).body);
  CHECK(session["role"] == "viewer");
  CHECK(session["user"].is_null());
  CHECK(session["login"] == false);
  CHECK(session["must_login"] == false);
  CHECK(session["can"] == json{{"alarms", false},
                               {"control", false},
                               {"tuning", false},
                               {"reports", false},
                               {"tests", false}});
  CHECK(rig.answer(rig.post_as("", kAlarm, kAcknowledge)).status == 403);
  CHECK(rig.orders.asked.empty());
  request.peer_is_loopback = false;
  CHECK(json::parse(rig.answer(request).body)["role"] == "none");
  Request alarms = ApiRig::get({"api", "alarms"});
  CHECK(rig.answer(alarms).status == 200);
  alarms.peer_is_loopback = false;
  CHECK(rig.answer(alarms).status == 401);
}

TEST_CASE("alarms are requested of a loop or of the box, by name") {
  ApiRig rig(true);
  const auto asked = [&](const Request& request) {
    rig.daemon.asked.clear();
    rig.orders.asked.clear();
    CHECK(rig.answer(request).status == 200);
    return (rig.daemon.asked.empty() ? rig.orders : rig.daemon).asked.at(0);
  };
  CHECK(asked(rig.get_as("vera", {"api", "loops", "FIC-101", "alarms"})) ==
        json{{"request", "alarm_design"}, {"loop", "FIC-101"}});
  CHECK(rig.answer(rig.get_as("vera", {"api", "loops", "FIC-999", "alarms"})).status == 404);
  CHECK(rig.answer(rig.get_as("vera", {"api", "loops", "box", "alarms"})).status == 404);
  Request figures = rig.get_as("vera", {"api", "alarm-figures"});
  figures.query["hours"] = "168";
  CHECK(asked(figures) == json{{"request", "alarm_figures"}, {"hours", 168}});
  figures.query["hours"] = "721";
  CHECK(rig.answer(figures).status == 400);
  CHECK(asked(rig.get_as("vera", {"api", "loops", "box", "alarms", "disk_full"})) ==
        json{{"request", "explain"}, {"loop", "box"}, {"alarm", "disk_full"}});
  const json order =
      asked(rig.post_as("otto", {"api", "loops", "box", "alarms", "disk_full"}, kAcknowledge));
  CHECK(order["loop"] == "box");
  CHECK(order["alarm"] == "disk_full");
}

TEST_CASE("before the log-in, users see only the session") {
  ApiRig rig(true);
  const std::vector<std::vector<std::string>> paths{{"api", "describe"},
                                                    {"api", "events"},
                                                    {"api", "sparklines"},
                                                    {"api", "alarms"},
                                                    {"api", "system"},
                                                    {"api", "journal"},
                                                    {"api", "reports"},
                                                    {"reports", "x"},
                                                    {"api", "loops", "FIC-101"},
                                                    {"api", "loops", "FIC-101", "alarms"},
                                                    {"api", "alarm-figures"},
                                                    {"api", "loops", "FIC-101", "reports"},
                                                    {"api", "loops", "FIC-101", "history"},
                                                    {"api", "loops", "FIC-101", "history.csv"},
                                                    {"api", "evidence", "x"}};
  for (const auto& path : paths) {
    CAPTURE(path);
    CHECK(rig.answer(ApiRig::get(path)).status == 401);
  }
  CHECK(rig.answer(ApiRig::get({"api", "session"})).status == 200);
  CHECK(json::parse(rig.answer(rig.get_as("otto", {"api", "session"})).body)["can"]["control"] ==
        true);
  CHECK(rig.daemon.asked.empty());
}

TEST_CASE("a viewer can't write, an operator can, and the journal receives the user") {
  ApiRig rig(true);
  CHECK(rig.answer(rig.post_as("vera", kAlarm, kAcknowledge)).status == 403);
  CHECK(rig.answer(rig.post_as("vera", kOrder, set_point(6.0, 5.0))).status == 403);
  CHECK(rig.orders.asked.empty());
  CHECK(rig.answer(rig.post_as("otto", kAlarm, kAcknowledge)).status == 200);
  CHECK(rig.answer(rig.post_as("ella", kAlarm, kAcknowledge)).status == 200);
  REQUIRE(rig.orders.asked.size() == 2);
  CHECK(rig.orders.asked[0]["user"] == "otto");
  CHECK(rig.orders.asked[0]["address"] == "127.0.0.1");
  CHECK(rig.orders.asked[0]["alarm"] == "stiction");
}

TEST_CASE("only an engineer can request a report") {
  ApiRig rig(true);
  const std::vector<std::string> path{"api", "loops", "FIC-101", "reports"};
  const json wish{{"kind", "gap"}, {"from_ms", 1'750'000'000'000}, {"to_ms", 1'750'000'060'000}};
  rig.orders.says = [](const json&) {
    return json{{"taken", true}, {"waiting", 2}, {"name", "x"}, {"on_disk", true}};
  };
  for (const char* user : {"vera", "otto"}) {
    CHECK(rig.answer(rig.post_as(user, path, wish)).status == 403);
    CHECK(json::parse(rig.answer(rig.get_as(user, {"api", "session"})).body)["can"]["reports"] ==
          false);
  }
  CHECK(rig.orders.asked.empty());
  CHECK(json::parse(rig.answer(rig.get_as("ella", {"api", "session"})).body)["can"]["reports"] ==
        true);
  const http::Response taken = rig.answer(rig.post_as("ella", path, wish));
  CHECK(taken.status == 200);
  CHECK(json::parse(taken.body)["waiting"] == 2);
  REQUIRE(rig.orders.asked.size() == 1);
  json request = wish;
  request.update(
      {{"request", "report"}, {"loop", "FIC-101"}, {"user", "ella"}, {"address", "127.0.0.1"}});
  CHECK(rig.orders.asked[0] == request);

  const auto refused = [&](const json& changed) {
    json other = wish;
    other.update(changed);
    return rig.answer(rig.post_as("ella", path, other)).status;
  };
  CHECK(refused({{"kind", 3}}) == 400);
  CHECK(refused({{"from_ms", "now"}}) == 400);
  CHECK(refused({{"out", "/etc"}}) == 400);
  CHECK(rig.orders.asked.size() == 1);

  rig.orders.says = [](const json&) { return json{{"taken", false}, {"waiting", 4}}; };
  const http::Response full = rig.answer(rig.post_as("ella", path, wish));
  CHECK(full.status == 429);
  CHECK(json::parse(full.body)["error"] == "4 reports wait already; one is made at a time");

  json without = describe_of_two();
  without["page"]["reports"] = false;
  rig.now.state = page::box_state_of(without);
  CHECK(rig.answer(rig.post_as("ella", path, wish)).status == 403);
}

TEST_CASE("requested reports are shown to everybody, with the page's link to each") {
  ApiRig rig(true);
  write_file(rig.settings.state_directory / "reports/one/report.html", "<title>Gap: x</title>");
  rig.daemon.says = [](const json&) {
    return json{{"reports",
                 {{{"name", "two"}, {"state", "done"}, {"page", "reports/two/report.html"}},
                  {{"name", "one"}, {"state", "done"}, {"page", "reports/one/report.html"}},
                  {{"name", "none"}, {"state", "failed"}, {"page", ""}}}}};
  };
  const http::Response answer =
      rig.answer(rig.get_as("vera", {"api", "loops", "FIC-101", "reports"}));
  REQUIRE(answer.status == 200);
  CHECK(rig.daemon.asked.at(0) == json{{"request", "reports"}, {"loop", "FIC-101"}});
  const json all = json::parse(answer.body)["reports"];
  CHECK_FALSE(all[0].contains("id"));  // not there yet
  CHECK(rig.answer(rig.get_as("vera", {"reports", all[1]["id"], "report.html"})).status == 200);
  CHECK_FALSE(all[2].contains("id"));
}

TEST_CASE("before the daemon's first answer its loops are unknown, not absent") {
  ApiRig rig(true);
  CHECK(rig.answer(rig.get_as("vera", {"api", "loops", "FIC-999"})).status == 404);
  rig.now.state = nullptr;
  CHECK(rig.answer(rig.get_as("vera", {"api", "loops", "FIC-101"})).status == 503);
  CHECK(rig.answer(rig.get_as("vera", {"api", "loops", "FIC-101", "history"})).status == 503);
  CHECK(rig.answer(rig.post_as("otto", kAlarm, kAcknowledge)).status == 503);
}

TEST_CASE("an operator can add a note to a loop, with the time that it concerns") {
  ApiRig rig(true);
  const std::vector<std::string> notes{"api", "loops", "FIC-101", "notes"};
  const json note{{"text", "pump changed"}, {"about_ms", 1'750'000'000'000}};
  CHECK(rig.answer(rig.post_as("vera", notes, note)).status == 403);
  CHECK(rig.answer(rig.post_as("otto", notes, {{"text", 5}})).status == 400);
  CHECK(rig.answer(rig.post_as("otto", notes, {{"text", "a"}, {"about_ms", -1}})).status == 400);
  CHECK(rig.orders.asked.empty());
  CHECK(rig.answer(rig.post_as("otto", notes, note)).status == 200);
  REQUIRE(rig.orders.asked.size() == 1);
  CHECK(rig.orders.asked[0] == json{{"request", "note"},
                                    {"loop", "FIC-101"},
                                    {"text", "pump changed"},
                                    {"about_ms", 1'750'000'000'000},
                                    {"user", "otto"},
                                    {"address", "127.0.0.1"}});
}

TEST_CASE("an incident is acknowledged by its id, and accepts no other action") {
  ApiRig rig(true);
  const std::vector<std::string> incident{"api", "loops", "FIC-101", "incidents",
                                          "FIC-101-20261124T145805Z"};
  CHECK(rig.answer(rig.post_as("vera", incident, kAcknowledge)).status == 403);
  CHECK(rig.answer(rig.post_as("otto", incident, {{"action", "shelve"}})).status == 400);
  CHECK(rig.orders.asked.empty());
  CHECK(rig.answer(rig.post_as("otto", incident, kAcknowledge)).status == 200);
  REQUIRE(rig.orders.asked.size() == 1);
  CHECK(rig.orders.asked[0] == json{{"request", "acknowledge_incident"},
                                    {"loop", "FIC-101"},
                                    {"incident", "FIC-101-20261124T145805Z"},
                                    {"reason", ""},
                                    {"user", "otto"},
                                    {"address", "127.0.0.1"}});
}

TEST_CASE("a POST needs the session's token, JSON and this origin") {
  ApiRig rig(true);
  Request request = rig.post_as("otto", kAlarm, kAcknowledge);
  SECTION("sound") { CHECK(rig.answer(request).status == 200); }
  SECTION("no token") {
    request.csrf.clear();
    CHECK(rig.answer(request).status == 403);
  }
  SECTION("an unknown token") {
    request.csrf = page::fingerprint("nobody");
    CHECK(rig.answer(request).status == 403);
  }
  SECTION("another session's token") {
    request.csrf = rig.post_as("otto", kAlarm, kAcknowledge).csrf;
    CHECK(rig.answer(request).status == 403);
  }
  SECTION("a form") {
    request.content_type = "application/x-www-form-urlencoded";
    CHECK(rig.answer(request).status == 415);
  }
  SECTION("a page of another site") {
    request.fetch_site = GENERATE("cross-site", "same-site");
    CHECK(rig.answer(request).status == 403);
  }
  SECTION("another origin") {
    request.origin =
        GENERATE("https://evil", "null", "http://localhost:8481", "https://localhost:8480");
    CHECK(rig.answer(request).status == 403);
  }
  SECTION("the page's own origin") {
    request.fetch_site = "same-origin";
    request.origin = "http://localhost:8480";
    CHECK(rig.answer(request).status == 200);
  }
}

TEST_CASE("a request with a foreign host name is refused") {
  ApiRig rig(false);
  const auto status = [&](const std::string& host) {
    Request request = ApiRig::get({"api", "session"});
    request.host = host;
    return rig.answer(request).status;
  };
  for (const char* host : {"localhost", "localhost:8480", "127.0.0.1:8480", "[::1]:8480",
                           "box.plant", "10.0.0.5:443"}) {
    CAPTURE(host);
    CHECK(status(host) == 200);
  }
  for (const char* host : {"evil.example", "localhost.evil.example:8480", "box.plant.evil", "",
                           "[::1", "127.0.0.1.evil"}) {
    CAPTURE(host);
    CHECK(status(host) == 403);
  }
}

TEST_CASE("unknown methods and addresses") {
  ApiRig rig(false);
  Request request = ApiRig::get({"api", "nothing"});
  CHECK(rig.answer(request).status == 404);
  request.path = {"api", "session"};
  request.method = Method::head;
  CHECK(rig.answer(request).status == 200);
  request.method = Method::other;
  CHECK(rig.answer(request).status == 405);
  request.method = Method::post;
  CHECK(rig.answer(request).status == 405);
  request.path = {"api", "loops", "FIC-1", "nothing"};
  CHECK(rig.answer(request).status == 404);
  request.path = {};
  CHECK(rig.answer(request).status == 405);
  CHECK(rig.answer(ApiRig::get({"api", "loops", "NONE"})).status == 404);
}

TEST_CASE("slow work has separate pools") {
  ApiRig rig(false);
  const auto pool = [&](std::vector<std::string> path, Method method = Method::get) {
    Request request = ApiRig::get(std::move(path));
    request.method = method;
    return rig.router().pool(request);
  };
  CHECK(pool({}) == Pool::here);
  CHECK(pool({"api", "events"}) == Pool::here);
  CHECK(pool({"api", "loops", "x", "history"}) == Pool::disk);
  CHECK(pool({"api", "login"}, Method::post) == Pool::log_in);
  CHECK(pool({"api", "loops", "x", "order"}, Method::post) == Pool::orders);
}

TEST_CASE("an order needs the daemon's right, the page's right and a matching confirmation") {
  ApiRig rig(true);
  rig.orders.says = [](const json& request) -> json {
    if (request["request"] == "set") return {{"order", 3}, {"sample_time_s", 0.1}};
    return {{"state", "done"}, {"why", ""}, {"on_disk", true}};
  };
  json body = set_point(6.0, 5.0);
  int expected = 200;
  SECTION("sound") {}
  SECTION("the page's right") {
    rig.settings.control = false;
    expected = 403;
  }
  SECTION("the daemon's right") {
    json description = describe_of_two();
    description["page"]["control"] = false;
    rig.now.state = page::box_state_of(description);
    expected = 403;
  }
  if (spoils_confirmation(body)) expected = 400;
  SECTION("another value") {
    body["confirm"]["new"] = 6.5;
    expected = 400;
  }
  SECTION("two values") {
    body["set"]["output"] = 3;
    expected = 400;
  }
  SECTION("an unknown value") {
    body["set"] = {{"gain", 3}};
    expected = 400;
  }
  SECTION("not a number") {
    body["set"]["set_point"] = "6";
    expected = 400;
  }
  SECTION("an extra key") {
    body["force"] = true;
    expected = 400;
  }
  CHECK(rig.answer(rig.post_as("otto", kOrder, body)).status == expected);
  if (expected != 200) {
    CHECK(rig.orders.asked.empty());
    return;
  }
  REQUIRE(rig.orders.asked.size() == 2);
  CHECK(rig.orders.asked[0] == json{{"request", "set"},
                                    {"loop", "FIC-101"},
                                    {"set_point", 6.0},
                                    {"expect", {{"set_point", 5.0}}},
                                    {"user", "otto"},
                                    {"address", "127.0.0.1"}});
  CHECK(rig.orders.asked[1] == json{{"request", "order"}, {"loop", "FIC-101"}, {"order", 3}});
}

TEST_CASE("an unknown output is ordered by a user to whom the page showed it as unknown") {
  ApiRig rig(true);
  rig.orders.says = [](const json& request) -> json {
    if (request["request"] == "set") return {{"order", 3}, {"sample_time_s", 0.1}};
    return {{"state", "done"}, {"why", ""}, {"now", nullptr}, {"on_disk", true}};
  };
  json body{{"set", {{"output", 3.0}}},
            {"confirm", {{"tag", "FIC-101"}, {"old", nullptr}, {"new", 3.0}}}};
  SECTION("the page showed no value") {
    CHECK(rig.answer(rig.post_as("otto", kOrder, body)).status == 200);
    CHECK(rig.orders.asked.at(0).at("expect") == json{{"output", nullptr}});
  }
  SECTION("another may have ordered it meanwhile") {
    rig.orders.says = [&](const json& request) -> json {
      if (request["request"] == "set") return {{"order", 3}, {"sample_time_s", 0.1}};
      return {{"state", "refused"}, {"why", "."}, {"now", {{"output", 4.5}}}, {"on_disk", true}};
    };
    const auto response = rig.answer(rig.post_as("otto", kOrder, body));
    CHECK(response.status == 409);
    CHECK(json::parse(response.body).at("now") == 4.5);
  }
  SECTION("a set point that was not known yet is compared with no value") {
    body = {{"set", {{"set_point", 3.0}}},
            {"confirm", {{"tag", "FIC-101"}, {"old", nullptr}, {"new", 3.0}}}};
    CHECK(rig.answer(rig.post_as("otto", kOrder, body)).status == 200);
    CHECK_FALSE(rig.orders.asked.at(0).contains("expect"));
  }
}

TEST_CASE("engineers set gains if the daemon allows it, with the gains that they have seen") {
  ApiRig rig(true);
  rig.orders.says = [](const json& request) -> json {
    if (request["request"] == "tune") return {{"order", 3}, {"sample_time_s", 0.1}};
    return {{"state", "done"}, {"why", ""}, {"on_disk", true}};
  };
  json description = describe_of_two();
  description["page"]["tuning"] = true;
  const json old{{"kp", 2.0}, {"ki", 0.5}, {"kd", 0.0}};
  const json wanted{{"kp", 3.0}, {"ki", 0.25}, {"kd", 0.0}};
  json body{{"set", wanted}, {"confirm", {{"tag", "FIC-101"}, {"old", old}, {"new", wanted}}}};
  std::string who = "ella";
  int expected = 200;
  SECTION("sound") {}
  SECTION("an operator") {
    who = "otto";
    expected = 403;
  }
  SECTION("the daemon's right") {
    description["page"]["tuning"] = false;
    expected = 403;
  }
  SECTION("another controller has the loop") {
    description["loops"][0]["control"] = "elsewhere";
    expected = 403;
  }
  if (spoils_confirmation(body)) expected = 400;
  SECTION("other gains") {
    body["confirm"]["new"]["ki"] = 0.26;
    expected = 400;
  }
  SECTION("no value that was seen") {
    body["confirm"].erase("old");
    expected = 400;
  }
  SECTION("not all of them") {
    body["set"].erase("kd");
    expected = 400;
  }
  SECTION("not a number") {
    body["set"]["kp"] = "3";
    expected = 400;
  }
  SECTION("an extra gain") {
    body["set"]["kf"] = 1.0;
    expected = 400;
  }
  rig.now.state = page::box_state_of(description);
  const auto session = rig.answer(rig.get_as(who, {"api", "session"}));
  CHECK(json::parse(session.body).at("can").at("tuning") ==
        (who == "ella" && description["page"]["tuning"] == true));
  CHECK(rig.answer(rig.post_as(who, kTuning, body)).status == expected);
  if (expected != 200) {
    CHECK(rig.orders.asked.empty());
    return;
  }
  REQUIRE(rig.orders.asked.size() == 2);
  CHECK(rig.orders.asked[0] == json{{"request", "tune"},
                                    {"loop", "FIC-101"},
                                    {"kp", 3.0},
                                    {"ki", 0.25},
                                    {"kd", 0.0},
                                    {"expect", old},
                                    {"user", "ella"},
                                    {"address", "127.0.0.1"}});
  rig.orders.says = [&](const json& request) -> json {
    if (request["request"] == "tune") return {{"order", 4}, {"sample_time_s", 0.1}};
    return {{"state", "refused"}, {"why", "."}, {"now", {{"gains", wanted}}}, {"on_disk", true}};
  };
  const auto late = rig.answer(rig.post_as(who, kTuning, body));
  CHECK(late.status == 409);
  CHECK(json::parse(late.body).at("now") == wanted);
}

TEST_CASE("gains are proposed by the twin or by the newest step of the record") {
  ApiRig rig(true);
  json description = describe_of_two();
  description["page"]["tuning"] = true;
  description["loops"][0]["twin"] = true;
  rig.now.state = page::box_state_of(description);
  const json gains{{"kp", 0.5}, {"ki", 0.05}, {"kd", 0.0}};
  std::string twin =
      "sample_time: 0.5\ncontroller: {kp: 0.5, ki: 0.05, output: [0, 100]}\n"
      "process: {gain: 1.5, time_constant: 8, dead_time: 3}\n"
      "transmitter: {range: [0, 100]}\n";
  double filter_s = 0.0;
  rig.daemon.says = [&](const json& request) -> json {
    if (request["request"] == "twin") return {{"model", twin}};
    return {{"name", "FIC-101"},
            {"sample_time_s", 0.5},
            {"explanation", nullptr},
            {"ranges",
             {{"pv_range", {0, 100}},
              {"co_range", {0, 100}},
              {"sp_limits", {0, 100}},
              {"output_limits", {0, 100}}}},
            {"gains", {{"in_force", gains}, {"file", gains}, {"derivative_filter_s", filter_s}}}};
  };
  http::Request request = rig.get_as("ella", kTuning);
  const auto proposed = [&] { return rig.answer(request); };

  SECTION("operators see no proposal") {
    request = rig.get_as("otto", kTuning);
    CHECK(proposed().status == 403);
  }
  SECTION("the twin, if the loop has one") {
    const json told = json::parse(proposed().body);
    CHECK(told.at("model").at("source") == "twin");
    CHECK(told.at("model").at("process").at("gain") == 1.5);
    CHECK(told.at("rules")[0].at("rule").is_null());
    CHECK(told.at("rules")[0].at("gains") == gains);
    CHECK(told.at("rules")[0].at("pv").size() == told.at("t").size());
    CHECK(told.at("t").size() <= 501);
    CHECK(told.at("in_force").at("in_force") == gains);
    CHECK(told.at("can_pid") == false);
    const json& best = told.at("rules").at(told.at("recommended").get<std::size_t>());
    CHECK(best.at("sensitivity") <= 2.0);
    CHECK(rig.orders.asked.empty());
  }
  SECTION("the record") {
    request.query["model"] = "record";
    const json none = json::parse(proposed().body);
    CHECK_THAT(none.at("model").at("why_not").get<std::string>(), Catch::Contains("no step"));
    CHECK_FALSE(none.contains("rules"));
    record_run(rig.settings.state_directory / "segments" / "FIC-101",
               recorded_plant({{0.0, 40.0}, {200.0, 60.0}}), 600.0);
    const json told = json::parse(proposed().body);
    CHECK(told.at("model").at("process").at("gain").get<double>() == Approx(1.5).epsilon(0.1));
    CHECK(told.at("model").at("step_ms") > kRecordStart_ms);
    CHECK(told.at("rules").size() > 3);
  }
  SECTION("PID if the loop filters its derivative") {
    request.query["form"] = "pid";
    CHECK(proposed().status == 409);
    filter_s = 0.2;
    const json told = json::parse(proposed().body);
    CHECK(std::any_of(told.at("rules").begin(), told.at("rules").end(),
                      [](const json& rule) { return rule.at("gains").at("kd") > 0.0; }));
  }
  SECTION("an invalid choice") {
    request.query["model"] = "guess";
    CHECK(proposed().status == 400);
    request.query["model"] = "twin";
    request.query["form"] = "p";
    CHECK(proposed().status == 400);
    request.query = {{"rule", "zn"}};
    CHECK(proposed().status == 400);
  }
  SECTION("a twin of another version") {
    twin = "process: {gains: 1.5}\n";
    CHECK(proposed().status == 409);
  }
}

TEST_CASE("a value that changed meanwhile is reported to the operator") {
  ApiRig rig(true);
  const std::string why = "the set point is now 5.5, 5 was expected";
  json expected{{"error", why}};
  SECTION("at once, if the daemon has no value") {
    rig.orders.says = [&](const json&) -> json {
      throw protocol::DaemonError(protocol::DaemonError::Kind::refused, why);
    };
  }
  SECTION("when the cycle refuses it") {
    rig.orders.says = [&](const json& request) -> json {
      if (request["request"] == "set") return {{"order", 3}, {"sample_time_s", 0.1}};
      return {{"state", "refused"}, {"why", why}, {"now", {{"set_point", 5.5}}}, {"on_disk", true}};
    };
    expected["now"] = 5.5;
  }
  const auto response = rig.answer(rig.post_as("otto", kOrder, set_point(6.0, 5.0)));
  CHECK(response.status == 409);
  CHECK(json::parse(response.body) == expected);
}

TEST_CASE("log-in, its delay, and its end") {
  ApiRig rig(true);
  const auto log_in = [&](const std::string& user, const std::string& password) {
    return rig.answer(rig.post_as("", {"api", "login"}, {{"user", user}, {"password", password}}));
  };
  const auto right = log_in("otto", "correct horse");
  REQUIRE(right.status == 200);
  CHECK(right.delay.count() == 0);
  CHECK(json::parse(right.body)["role"] == "operator");
  const std::string cookie = right.headers.at(0).second;
  CHECK(cookie.find("HttpOnly; SameSite=Strict") != std::string::npos);
  CHECK(cookie.find("Secure") == std::string::npos);
  SECTION("a wrong password and an unknown user are the same") {
    const auto wrong = log_in("otto", "wrong");
    const auto unknown = log_in("nobody", "wrong");
    CHECK(wrong.status == 401);
    CHECK(wrong.body == unknown.body);
    CHECK(wrong.delay == unknown.delay);
    CHECK(wrong.delay >= std::chrono::seconds(1));
  }
  SECTION("too many tries") {
    int refused = 0;
    for (int i = 0; i < 12; ++i) refused += log_in("otto", "wrong").status == 429;
    CHECK(refused > 3);
  }
  SECTION("over TLS the cookie is for TLS") {
    Request request =
        rig.post_as("", {"api", "login"}, {{"user", "otto"}, {"password", "correct horse"}});
    request.secure = true;
    CHECK(rig.answer(request).headers.at(0).second.find("; Secure") != std::string::npos);
  }
  SECTION("log-out") {
    const std::string value = cookie.substr(cookie.find('=') + 1, 43);
    Request request = ApiRig::get({"api", "alarms"});
    request.cookies[page::api::kCookie] = value;
    CHECK(rig.answer(request).status == 200);
    Request out = rig.post_as("", {"api", "logout"}, json::object());
    out.cookies = request.cookies;
    out.csrf = json::parse(right.body)["csrf"];
    CHECK(rig.answer(out).status == 200);
    CHECK(rig.answer(request).status == 401);
  }
}

TEST_CASE("log-in by a directory") {
  using End = page::ldap::Outcome::End;
  ApiRig rig(true);
  rig.settings.ldap = page::LdapSettings();
  rig.settings.ldap->domains = {"PLANT"};
  const auto attempt = [&](const std::string& user, const std::string& password) {
    return rig.post_as("", {"api", "login"}, {{"user", user}, {"password", password}});
  };
  const auto log_in = [&](const std::string& user, const std::string& password) {
    return rig.answer(attempt(user, password));
  };
  const auto with_cookie = [](const http::Response& response, std::vector<std::string> path) {
    Request request = ApiRig::get(std::move(path));
    const std::string& cookie = response.headers.at(0).second;
    request.cookies[page::api::kCookie] = cookie.substr(cookie.find('=') + 1, 43);
    return request;
  };
  rig.directory.says = {End::admitted, page::Role::operator_, "uid=nora", ""};
  SECTION("it gives the role, and the session shows the source") {
    const auto response = log_in("PLANT\\Nora", "her own");
    REQUIRE(response.status == 200);
    CHECK(rig.directory.asked == std::vector<std::string>{"nora|her own|loopback"});
    const json session = json::parse(response.body);
    CHECK(session["user"] == "nora");
    CHECK(session["role"] == "operator");
    CHECK(session["source"] == "directory");
    CHECK(rig.answer(with_cookie(response, {"api", "alarms"})).status == 200);
    CHECK(json::parse(log_in("otto", "correct horse").body)["source"] == "file");
    SECTION("and the session ends with it") {
      rig.users().dismiss("nora");
      CHECK(rig.answer(with_cookie(response, {"api", "alarms"})).status == 401);
    }
    SECTION("or when the name is another entry's") {
      rig.users().admit("nora", page::Role::operator_, "uid=another");
      CHECK(rig.answer(with_cookie(response, {"api", "alarms"})).status == 401);
    }
    SECTION("a second session leaves the first") {
      CHECK(log_in("nora", "her own").status == 200);
      CHECK(rig.answer(with_cookie(response, {"api", "alarms"})).status == 200);
    }
  }
  SECTION("a name of the file uses the file, whatever the directory answers") {
    CHECK(log_in("otto", "of the directory").status == 401);
    CHECK(log_in("OTTO", "of the directory").status == 401);
    CHECK(log_in("PLANT\\otto", "of the directory").status == 401);
    CHECK(rig.directory.asked.empty());
  }
  SECTION("it receives no empty password, and no name that it can't have") {
    CHECK(log_in("nora", "").status == 401);
    CHECK(log_in("OTHER\\nora", "her own").status == 401);
    CHECK(log_in("*", "her own").status == 401);
    CHECK(rig.directory.asked.empty());
  }
  SECTION("a refusal has the text and the delay of one by the file") {
    rig.directory.says = {End::wrong, page::Role::none, "", "no such user"};
    const auto of_directory = log_in("nora", "wrong");
    const auto of_file = log_in("otto", "wrong");
    CHECK(of_directory.status == 401);
    CHECK(of_directory.body == of_file.body);
    for (const auto* response : {&of_directory, &of_file}) {
      CHECK(response->delay >= std::chrono::seconds(1));
      CHECK(response->delay <= std::chrono::seconds(2));
    }
  }
  SECTION("the limit of attempts is the same as by the file") {
    rig.directory.says = {End::wrong, page::Role::none, "", "no such user"};
    int refused = 0;
    for (const char* user :
         {"nora", "Nora", "NORA", "PLANT\\nora", "nora", "noRa", "norA", "nora"}) {
      refused += log_in(user, "wrong").status == 429;
    }
    CHECK(refused == 3);
    CHECK(rig.directory.asked.size() == 5);
  }
  SECTION("no group") {
    rig.directory.says = {End::no_group, page::Role::none, "", "no group"};
    const auto response = log_in("nora", "her own");
    CHECK(response.status == 403);
    CHECK(response.headers.empty());
    CHECK(response.delay >= std::chrono::seconds(1));
    CHECK(response.delay <= std::chrono::seconds(2));
  }
  SECTION("it is away: new users can't log in by it, the file's users can") {
    rig.directory.says = {End::unavailable, page::Role::none, "", "away"};
    rig.directory.full = GENERATE(false, true);  // or too many wait for it
    // These attempts don't count, because the directory did not check them.
    for (int i = 0; i < 30; ++i) {
      const auto response = log_in("nora", "her own");
      CHECK(response.status == 503);
      CHECK(response.delay >= std::chrono::seconds(1));
    }
    CHECK(log_in("otto", "wrong").status == 401);
    CHECK(log_in("otto", "correct horse").status == 200);
  }
  SECTION("it receives the time for which the client waits") {
    const auto now = std::chrono::steady_clock::now();
    CHECK(log_in("nora", "her own").status == 200);
    CHECK(rig.directory.waits_until > now);
    CHECK(rig.directory.waits_until < now + std::chrono::hours(1));
  }
  SECTION("no thread waits for its answer") {
    rig.directory.silent = true;
    http::Response response = rig.router().answer(attempt("nora", "her own"));
    REQUIRE(response.next);
    response = response.next();
    REQUIRE(response.next);
    rig.directory.answer.set_value(rig.directory.says);
    response = response.next();
    CHECK(response.status == 200);
    CHECK(json::parse(response.body)["user"] == "nora");
  }
}

TEST_CASE("one network has one limit of attempts, for all its addresses") {
  ApiRig rig(true);
  const auto refused = [&](const std::string& before) {
    int count = 0;
    for (int i = 0; i < 30; ++i) {
      Request request = rig.post_as("", {"api", "login"},
                                    {{"user", "u" + std::to_string(i)}, {"password", "wrong"}});
      request.peer = before + std::to_string(i + 1);
      request.network = before;
      count += rig.answer(request).status == 429;
    }
    return count;
  };
  CHECK(refused("2001:db8:0:1::") >= 10);
}

TEST_CASE("requests by a person keep the session alive, automatic requests don't") {
  ApiRig rig(true);
  const auto now = std::chrono::steady_clock::now();
  Request request = rig.post_as("otto", kAlarm, kAcknowledge);
  request.method = Method::get;
  request.path = {"api", "alarms"};
  const std::string cookie = request.cookies.at(page::api::kCookie);
  const auto nobody_since_29_minutes = [&] {
    REQUIRE(rig.use(cookie, now - std::chrono::minutes(29)));
  };
  nobody_since_29_minutes();
  bool kept = false;
  SECTION("an automatic request") { CHECK(rig.answer(request).status == 200); }
  SECTION("a stream") {
    request.path = {"api", "events"};
    const auto response = rig.answer(request);
    REQUIRE(response.may_stay);
    CHECK(response.may_stay());
  }
  SECTION("an automatic request while a person is active") {
    request.person = true;
    CHECK(rig.answer(request).status == 200);
    kept = true;
  }
  SECTION("a POST") {
    request.method = Method::post;
    request.path = kAlarm;
    CHECK(rig.answer(request).status == 200);
    kept = true;
  }
  SECTION("a stream that a person began does not keep it alive") {
    request.path = {"api", "events"};
    request.person = true;
    const auto response = rig.answer(request);
    nobody_since_29_minutes();
    CHECK(response.may_stay());
  }
  CHECK(rig.holds(cookie, now + std::chrono::minutes(2)) == kept);
}

TEST_CASE("names of a new certificate are valid at once, those of the old one no longer") {
  ApiRig rig(false);
  const auto status = [&](const std::string& host) {
    Request request = ApiRig::get({"api", "session"});
    request.host = host;
    return rig.answer(request).status;
  };
  CHECK(status("box.plant") == 200);
  rig.hosts.replace({"new.plant"});
  CHECK(status("box.plant") == 403);
  CHECK(status("new.plant:8443") == 200);
}

TEST_CASE("the page polls for the outcome of an order to a slow loop") {
  ApiRig rig(true);
  int looks = 0;
  std::string last = "done";
  rig.orders.says = [&](const json& request) -> json {
    if (request["request"] == "set") return {{"order", 3}, {"sample_time_s", 60.0}};
    if (++looks < 4) return {{"state", "waiting"}, {"why", ""}, {"on_disk", false}};
    if (last == "gone") throw protocol::DaemonError(protocol::DaemonError::Kind::down, "gone");
    return {{"state", last}, {"why", "too warm"}, {"on_disk", true}};
  };
  int status = 200;
  SECTION("taken") {}
  SECTION("refused") { last = "refused"; }
  SECTION("the daemon ends meanwhile") {
    last = "gone";
    status = 503;
  }
  const auto response = rig.answer(rig.post_as("otto", kOrder, set_point(6.0, 5.0)));
  CHECK(response.status == status);
  CHECK(rig.rounds == 3);
  CHECK(rig.orders.asked.size() == 5);
  if (status == 200) CHECK(json::parse(response.body)["state"] == last);
}

TEST_CASE("the report of one piece of evidence is requested by its name") {
  ApiRig rig(false);
  write_file(rig.folder / "state/evidence/20261124T070000000Z-FIC-101-stiction/report.html",
             "<title>Gap: FIC-101</title>");
  write_file(rig.folder / "state/gap/report.html", "<title>Gap: boiler</title>");
  Request request = ApiRig::get({"api", "reports"});
  CHECK(json::parse(rig.answer(request).body).size() == 2);
  request.query["evidence"] = "20261124T070000000Z-FIC-101-stiction";
  const json one = json::parse(rig.answer(request).body);
  REQUIRE(one.size() == 1);
  CHECK(one[0]["evidence"] == request.query["evidence"]);
  request.query["evidence"] = "another";
  CHECK(json::parse(rig.answer(request).body).empty());
}

TEST_CASE("a stream ends with its session") {
  ApiRig rig(true);
  const Request request = rig.get_as("vera", {"api", "events"});
  const auto response = rig.answer(request);
  REQUIRE(response.may_stay);
  CHECK(response.may_stay());
  rig.log_out(request.cookies.at(page::api::kCookie));
  CHECK_FALSE(response.may_stay());
}

TEST_CASE("an absent daemon gives 503, and a refusal gives 409 with the daemon's text") {
  ApiRig rig(false);
  rig.daemon.says = [](const json&) -> json {
    throw protocol::DaemonError(protocol::DaemonError::Kind::down, "gone");
  };
  CHECK(rig.answer(ApiRig::get({"api", "journal"})).status == 503);
  rig.daemon.says = [](const json&) -> json {
    throw protocol::DaemonError(protocol::DaemonError::Kind::refused, "no");
  };
  CHECK(rig.answer(ApiRig::get({"api", "journal"})).body == R"({"error":"no"})");
}

TEST_CASE("setups under way are shown with the box, if the daemon supports them") {
  ApiRig rig(false);
  bool knows = true;
  rig.daemon.says = [&](const json& request) -> json {
    if (request["request"] == "status")
      return {{"daemon", json::object()}, {"loops", json::array()}};
    if (!knows) {
      throw protocol::DaemonError(protocol::DaemonError::Kind::refused, "no request 'setups'");
    }
    return {{"setups", {{{"loop", "FIC-101"}}}}};
  };
  const auto setups = [&] {
    const http::Response response = rig.answer(ApiRig::get({"api", "system"}));
    CHECK(response.status == 200);
    return json::parse(response.body)["setups"];
  };
  CHECK(setups() == json{{{"loop", "FIC-101"}}});
  knows = false;
  CHECK(setups() == json::array());
}

TEST_CASE("queries are strict") {
  ApiRig rig(false);
  const auto status = [&](const std::string& key, const std::string& value) {
    Request request = ApiRig::get({"api", "loops", "FIC-101", "history"});
    request.query[key] = value;
    return rig.answer(request).status;
  };
  CHECK(status("points", "100") == 200);
  for (const char* value : {"0", "-5", "4001", "x", "1e3", "99999999999999999999", "5 "}) {
    CAPTURE(value);
    CHECK(status("points", value) == 400);
  }
  CHECK(status("form_ms", "5") == 400);
  CHECK(status("from_ms", "4000000000000") == 400);
}

}  // namespace loopwarden::tests::router_test
