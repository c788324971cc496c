// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <string>

#include <catch2/catch.hpp>

#include "tests/daemon/console/console_bench.hpp"

namespace loopwarden::daemon::report_request_test {
namespace {

using console::SocketName;
using console_bench::Bench;
using console_bench::json;
using console_bench::kOldest_ms;

const console::Rights kReports{.page = {.alarms = false, .control = false, .reports = true},
                               .edge = {}};

struct Recorded : Bench {
  Recorded() : Bench(kReports, control::OutputAction::go_to(40.0), true) {
    REQUIRE(
        test::eventually([&] { return historian.status(0).segments.oldest_utc_ms == kOldest_ms; }));
  }
  json asked(const json& changed = json::object()) {
    json request{{"request", "report"},
                 {"loop", "FIC-101"},
                 {"kind", "gap"},
                 {"from_ms", kOldest_ms},
                 {"to_ms", kOldest_ms + 3'600'000},
                 {"user", "ella"},
                 {"address", "10.0.0.5"}};
    request.update(changed);
    return ask(request.dump(), SocketName::page);
  }
  std::string refused(const json& changed) {
    const json answer = asked(changed);
    INFO(answer.dump());
    CHECK(answer.at("ok") == false);
    return answer.value("error", "");
  }
};

}  // namespace

TEST_CASE("a report is accepted within the recorded time, for an existing loop and kind",
          "[console][reports]") {
  Recorded bench;
  CHECK(bench.refused({{"loop", "FIC-999"}}) == "no loop 'FIC-999'");
  CHECK(bench.refused({{"loop", "../FIC-101"}}) == "no loop '../FIC-101'");
  for (const json& kind : {json("explain"), json("gap --out=/"), json("")}) {
    CHECK(bench.refused({{"kind", kind}}) ==
          "kind is gap, commission, survey, diagnose or receipt");
  }
  CHECK(bench.refused({{"kind", 1}}) == "a text is needed for \"kind\"");
  CHECK(bench.refused({{"from_ms", kOldest_ms - 1}}) ==
        "from_ms: what is recorded of FIC-101 begins at 2027-01-03T18:13:20Z (1799000000000)");
  CHECK(bench.refused({{"from_ms", 0.5}}) == "from_ms must be a whole number");
  CHECK(bench.refused({{"to_ms", -1}}) == "to_ms must be a whole number");
  CHECK(bench.refused({{"to_ms", kOldest_ms}}) == "from_ms must be before to_ms");
  CHECK(bench.refused({{"to_ms", bench.now_ms + 1}}) == "to_ms: a time that has been");
  CHECK(bench.refused({{"to_ms", std::uint64_t{18'446'744'073'709'551'615U}}}) ==
        "to_ms: a time that has been");
  CHECK(bench.refused({{"to_ms", kOldest_ms + 59'999}}) == "at least 60 s are needed");
  // A million samples, one every 0.1 s.
  CHECK(bench.refused({{"to_ms", kOldest_ms + 100'000'001}}) ==
        "gap takes at most 27.8 h of FIC-101 (1000000 samples)");
  CHECK(bench.refused({{"kind", "commission"}, {"to_ms", kOldest_ms + 20'000'001}}) ==
        "commission takes at most 5.56 h of FIC-101 (200000 samples)");
  CHECK(bench.reports
            .post({.loop = "FIC-101", .kind = {}, .from_ms = 1, .to_ms = 2, .by = {}, .twin = {}})
            ->place == 1);
  CHECK(bench.asked({{"to_ms", kOldest_ms + 100'000'000}}).at("waiting") == 2);
  CHECK(bench.asked({{"from_ms", bench.now_ms - 60'000}, {"to_ms", bench.now_ms}}).at("taken") ==
        true);
}

TEST_CASE("the fifth report is refused, and the journal has its author", "[console][reports]") {
  Recorded bench;
  for (int k = 1; k <= 4; ++k) CHECK(bench.asked().at("waiting") == k);
  const json fifth = bench.asked();
  CHECK(fifth.at("ok") == true);
  CHECK(fifth.at("taken") == false);
  CHECK(fifth.at("waiting") == 4);
  const auto lines = bench.lines(5);
  CHECK(lines.front().at("what") == "report");
  CHECK(lines.front().at("peer") == "ella@10.0.0.5 by page (uid 1000)");
  CHECK(lines.front().at("new") == "FIC-101-gap-20270115T080000000Z");
  CHECK(lines.front().at("result") == "asked for");
  CHECK(lines.back().at("result") == "refused: as many as may wait do");

  bench.reports.run_next([](std::chrono::milliseconds) { return false; });
  const json all = bench.ask_status(R"({"request": "reports", "loop": "FIC-101"})").at("reports");
  REQUIRE(all.size() == 4);
  CHECK(all[3].at("state") == "failed");  // the report maker here writes no file
  CHECK(all[3].at("by") == "ella@10.0.0.5 by page (uid 1000)");
  CHECK(all[3].at("from_ms") == kOldest_ms);
  CHECK(all[2].at("state") == "waiting");
  CHECK(all[2].at("place") == 1);
}

}  // namespace loopwarden::daemon::report_request_test
