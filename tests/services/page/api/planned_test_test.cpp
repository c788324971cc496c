// SPDX-License-Identifier: Apache-2.0
// The test that an explanation proposes, carried out from the page.
#include <catch2/catch.hpp>

#include <algorithm>
#include <atomic>
#include <thread>

#include "base/digest/digest.hpp"
#include "tests/services/page/support/api_rig.hpp"
#include "tests/support/text.hpp"

namespace loopwarden::tests::planned_test_test {
namespace {

using nlohmann::json;

constexpr const char* kEvidence = "20261129T070000000Z-FIC-101-model_gap";
constexpr std::int64_t kPlanned_s = 1'795'911'684;  // planned_at
const std::vector<std::string> kTest{"api", "loops", "FIC-101", "test"};
const std::string kPlan = R"(loop: "FIC-101"
planned_at: "2026-11-29T00:21:24Z"
model: "twin.yaml"
record: "next_test.record.csv"
move: set_point_pair
from: 5
size: 0.15
hold: 60
limits: {pv: [4.5, 5.5], co: [3, 6]}
expected: {probability_right: 0.96, probability_wrong: 0.01, pv_swing: 0.2, output_swing: 0.5}
explanations:
  - {effects: ["stiction"], probability: 0.6}
  - {effects: ["backlash"], probability: 0.4}
)";

// A daemon whose loop takes every move.
struct Rig : ApiRig {
  Rig() : ApiRig(true) {
    json about = describe_of_two();
    about["page"]["tests"] = true;
    about["loops"][1]["control"] = "elsewhere";
    now.state = page::box_state_of(about);
    const std::string evidence = std::string("state/evidence/") + kEvidence;
    write_file(folder / evidence / "next_test.yaml", kPlan);
    write_file(folder / evidence / "twin.yaml",
               read_file(LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml"));
    write_file(folder / evidence / "next_test.record.csv", "time,pv,sp,co\n0,5,5,4\n0.1,5,5,4\n");
    daemon.says = [this](const json& request) { return reading(request); };
    orders.says = [this](const json& request) { return order(request); };
  }

  json reading(const json& request) {
    const std::string name = request.at("request");
    if (name == "trend") {
      ++period;
      return protocol::Trend{.period = {period},
                             .sample_time_s = 0.1,
                             .sp = {5.0},
                             .pv = {5.0},
                             .co = {4.0},
                             .stem = {4.0},
                             .jacket = {0.0},
                             .compensator = {0.0},
                             .mode = {"AUTO"}};
    }
    protocol::LoopStatus loop{.name = "FIC-101", .pv_range = {0.0, 10.0}, .sample_time_s = 0.1};
    loop.cycle = protocol::Cycle{.sp = 5.0, .pv = 5.0, .co = 4.0, .set_point_wanted = sp};
    if (name == "status") {
      protocol::Status status;
      status.loops.push_back(std::move(loop));
      return status;
    }
    protocol::LoopAnswer answer{.status = std::move(loop)};
    answer.explanation =
        protocol::Explanation{.alarm = "model_gap", .folder = std::string("/x/") + kEvidence};
    return answer;
  }

  json order(const json& request) const {
    const std::string name = request.at("request");
    if (name == "commissioning") return {{"session", 7}};
    if (name == "reload") return {{"reload", 1}};
    if (name != "reload_state") return json::object();
    protocol::LoopPlan loop{.loop = "FIC-101", .file = "a.yaml", .decision = "apply"};
    loop.file_hash = 1;
    loop.file_time_s = file_time_s;
    protocol::ReloadOutcome outcome{.outcome = "in_force"};
    outcome.plan = protocol::ReloadPlan{.daemon = {}, .loops = {loop}};
    return protocol::ReloadState{.state = "done", .outcome = outcome};
  }

  json shown(const char* user = "vera") { return json::parse(answer(get_as(user, kTest)).body); }
  http::Response start(const char* user, const json& confirm,
                       const std::vector<std::string>& path = kTest) {
    return answer(post_as(user, path, {{"action", "start"}, {"confirm", confirm}}));
  }
  json confirm() { return {{"tag", "FIC-101"}, {"plan", shown()["plan"]["id"]}}; }
  // Number of requests to page.sock with this key.
  long commanded(const char* key) {
    return std::count_if(orders.asked.begin(), orders.asked.end(),
                         [&](const json& one) { return one.contains(key); });
  }

  std::uint64_t period = 0;
  double sp = 5.0;
  std::int64_t file_time_s = kPlanned_s;
};

}  // namespace

TEST_CASE("a viewer sees the proposed test, with what each outcome means") {
  Rig rig;
  const json plan = rig.shown()["plan"];
  CHECK(plan["duration_s"] == 120.0);
  CHECK(plan["size"] == 0.15);
  CHECK(plan["pv_swing"] == 0.2);
  CHECK(plan["pv_limits"] == json{4.5, 5.5});
  CHECK(plan["outcomes"][0]["name"] == "stiction");
  CHECK(plan["outcomes"][0]["remedy"].get<std::string>().size() > 10);
  CHECK(rig.shown()["test"].is_null());
  CHECK(rig.orders.asked.empty());
}

TEST_CASE("a test needs an engineer, the right, the typed tag and a plan that is not old") {
  Rig rig;
  const json confirm = rig.confirm();
  const auto refused = [&](const http::Response& response, int status, const char* why) {
    CHECK(response.status == status);
    CHECK_THAT(json::parse(response.body)["error"].get<std::string>(), Catch::Contains(why));
  };
  refused(rig.start("vera", confirm), 403, "operator");
  refused(rig.start("otto", confirm), 403, "engineer");
  refused(rig.start("ella", {{"tag", "FIC-102"}, {"plan", confirm["plan"]}}), 400, "another loop");
  refused(rig.start("ella", {{"tag", "FIC-101"}, {"plan", "00000000"}}), 409, "changed meanwhile");
  refused(rig.start("ella", {{"tag", "FIC-101"}, {"plan", confirm["plan"]}, {"size", 5}}), 400,
          "size");
  refused(rig.start("ella", confirm, {"api", "loops", "FIC-102", "test"}), 403, "slip");
  CHECK(rig.answer(rig.post_as("ella", kTest, {{"action", "dance"}})).status == 400);
  SECTION("the loop's file is newer") {
    rig.file_time_s = kPlanned_s + 1;
    refused(rig.start("ella", confirm), 409, "has changed since the plan was made");
  }
  SECTION("SP is elsewhere") {
    rig.sp = 6.0;
    refused(rig.start("ella", confirm), 409, "SP is 6");
  }
  SECTION("page.yaml") {
    rig.settings.control = false;
    refused(rig.start("ella", confirm), 403, "page.yaml");
  }
  SECTION("loopwardend.yaml") {
    rig.now.state = page::box_state_of(describe_of_two());
    refused(rig.start("ella", confirm), 403, "tests: true");
  }
  SECTION("a plan that can't be read is not offered") {
    write_file(rig.folder / "state/evidence" / kEvidence / "next_test.yaml",
               with(kPlan, "size: 0.15", "size: 0"));
    CHECK(rig.shown()["plan"].is_null());
    refused(rig.start("ella", confirm), 409, "changed meanwhile");
  }
  CHECK(rig.commanded("test") == 0);
}

TEST_CASE("a test shows its progress, and an operator stops it") {
  Rig rig;
  REQUIRE(rig.start("ella", rig.confirm()).status == 200);
  const auto state = [&](const char* user = "vera") { return rig.shown(user)["test"]; };
  CHECK(state()["by"] == "ella");
  CHECK(state()["duration_s"] == 120.0);
  CHECK(rig.start("ella", rig.confirm()).status == 409);
  CHECK(rig.answer(rig.post_as("vera", kTest, {{"action", "stop"}})).status == 403);
  while (state("ella")["time_s"] < 0.5) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  CHECK(rig.answer(rig.post_as("otto", kTest, {{"action", "stop"}})).status == 200);
  while (state()["phase"] != "over") std::this_thread::sleep_for(std::chrono::milliseconds(5));
  CHECK(state()["ended_early"] == "stopped by otto");
  CHECK(state()["restored"] == true);
  CHECK(state()["sentence"].is_null());
  REQUIRE(rig.commanded("test") == 1);
  CHECK(rig.commanded("move") == 1);
  CHECK(rig.commanded("end") == 1);
  const auto begun = std::find_if(rig.orders.asked.begin(), rig.orders.asked.end(),
                                  [](const json& one) { return one.contains("test"); });
  CHECK(rig.orders.asked.back()["why"] == "stopped by otto");
  CHECK((*begun)["user"] == "ella");
  CHECK((*begun)["address"] == "127.0.0.1");
  CHECK((*begun)["test"]["moved"] == json{4.85, 5.15});
  CHECK((*begun)["test"]["pv"] == json{4.5, 5.5});
}

TEST_CASE("a test ends if its page was not open for 60 s") {
  using page::planned_test::TestRunner;
  Rig rig;
  std::atomic<int> now_s{0};
  TestRunner runner(rig.daemon, rig.orders,
                    [&] { return TestRunner::Clock::time_point(std::chrono::seconds(now_s)); });
  page::planned_test::WantedTest wanted;
  wanted.plan = *protocol::read_test_plan_text("plan", kPlan);
  wanted.person.user = "ella";
  REQUIRE(runner.start(std::move(wanted)));
  const auto state = [&](bool follows) { return runner.state("FIC-101", follows).value(); };
  const auto wait = [](const auto& until) {
    while (!until()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  now_s = 50;
  CHECK(state(true).by == "ella");  // the engineer looks at it
  now_s = 105;
  const double then_s = state(false).now.time_s;
  wait([&] { return state(false).now.time_s > then_s + 0.5; });
  now_s = 111;
  wait([&] { return state(false).phase == page::planned_test::TestState::Phase::over; });
  CHECK(state(false).ended_early == "the page of the loop was not open for 60 s");
  CHECK(state(false).restored);
}

}  // namespace loopwarden::tests::planned_test_test
