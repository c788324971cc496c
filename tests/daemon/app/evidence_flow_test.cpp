// SPDX-License-Identifier: Apache-2.0
// A script replaces `loopwarden` here. It counts its calls, and fails at the run that the test
// names.
#include "daemon/app/evidence_flow.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "model/alarm/limits.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::evidence_flow_test {
namespace {

namespace fs = std::filesystem;
using alarm::AlarmKind;

constexpr std::int64_t kRaised_ms = 1'800'000'000'000;

struct Bench {
  // `fails`: the number of the run that ends with an error; 0: no run fails.
  explicit Bench(double faster, int fails = 0) {
    std::ofstream(folder / "explain")
        << "#!/bin/sh\necho run >> '" << runs_file().string() << "'\n[ $(wc -l < '"
        << runs_file().string() << "') = " << fails
        << R"( ] && exit 65
cat > "$3/explanation.json" <<'J'
{"alarm": "model_gap", "final_name": null, "raised_ms": 1800000000000, "ended_ms": 1800000000100,
 "verdict": "missing_effect", "gap_closed": 0.9, "agrees": true, "from_s": null, )"
           R"("sentence": "", "first": null,
 "effects": []}
J
)";
    fs::permissions(folder / "explain", fs::perms::owner_all);
    loops.front().config.name = "FIC-101";
    loops.front().config.sample_time_s = 1.0;
    loops.front().config.monitor.twin = "twin.yaml";
    config.state_directory = folder.path();
    config.accelerate = faster;
    specialists.twins.emplace("twin.yaml", twin);
  }
  EvidenceFlow make() {
    return {config,
            specialists,
            {.loops = loops,
             .alarms = board,
             .journal = journal,
             .config_hash = [] { return 1U; },
             .history = [this](std::size_t) { return &*history; },
             .explain = folder / "explain"}};
  }
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      watch::Cycle cycle;
      cycle.period_index = next++;
      cycle.automatic = cycle.pv_good = true;
      history->add(cycle);
    }
  }
  void judge(bool gap) {
    alarm::AlarmConditions conditions{};
    conditions[alarm::index_of(AlarmKind::model_gap)].on = gap;
    board.of(0).twin_judged(conditions);
  }
  void raise(EvidenceFlow& flow) {
    judge(true);
    flow.keep(0, AlarmKind::model_gap, monitor, {}, alarm::AlarmReason::twin);
  }
  fs::path runs_file() const { return folder / "runs"; }
  long runs() const {
    const std::string text = fs::exists(runs_file()) ? tests::read_file(runs_file()) : "";
    return std::count(text.begin(), text.end(), '\n');
  }
  template <class Until>
  static bool wait(Until until) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!until() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return until();
  }
  // Returns true once all requested runs have ended.
  static bool done(const EvidenceFlow& flow, std::uint64_t count) {
    return wait([&] {
      const ExplainerStatus s = flow.explainer().status();
      return s.waiting == 0 && s.explained + s.failed >= count;
    });
  }

  tests::TemporaryFolder folder;
  std::int64_t now_ms = kRaised_ms;
  std::uint64_t next = 1;
  std::vector<LoopRuntime> loops{1};
  plant::LoopModel twin;
  std::optional<supervision::History> history{std::in_place, 3300.0, 1.0};
  watch::LoopMonitor monitor{{.sample_time_s = 1.0}, {}, nullptr, &twin};
  config::DaemonConfig config;
  config::Specialists specialists;
  journal::Journal journal{{.folder = folder / "journal"}};
  supervision::AlarmRegistry board{{{"FIC-101", 1.0}}, {}, journal, [this] { return now_ms; }};
};

}  // namespace

TEST_CASE("an incident that lasts is explained after 10, 20 and 40 minutes, though one fails",
          "[explain]") {
  const int fails = GENERATE(0, 1, 2);
  Bench bench(10'000.0, fails);
  bench.run(100);
  EvidenceFlow flow = bench.make();
  flow.start();
  bench.raise(flow);
  CHECK(Bench::done(flow, 3));
  CHECK(bench.runs() == 3);
  CHECK(flow.explainer().status().failed == (fails == 0 ? 0 : 1));
}

TEST_CASE("a change that is already older is explained at the remaining moments", "[explain]") {
  Bench bench(10'000.0);
  bench.run(1300);
  EvidenceFlow flow = bench.make();
  flow.start();
  bench.raise(flow);
  CHECK(Bench::done(flow, 2));
  CHECK(bench.runs() == 2);
}

TEST_CASE("an incident is not explained again in the next one", "[explain]") {
  Bench bench(500.0);
  bench.run(600);
  EvidenceFlow flow = bench.make();
  flow.start();
  bench.raise(flow);
  REQUIRE(Bench::wait([&] { return bench.board.snapshot(0).explanation != nullptr; }));
  bench.judge(false);
  bench.now_ms += alarm::AlarmLimits::kJoin_ms + alarm::AlarmLimits::kQuiet_ms;
  bench.board.of(0).pass_time();
  REQUIRE_FALSE(bench.board.snapshot(0).incident.incident().open());
  bench.judge(true);
  REQUIRE(bench.board.snapshot(0).incident.incident().open());
  CHECK(Bench::done(flow, 1));
  CHECK(bench.runs() == 1);
}

TEST_CASE("an incident that lasts is explained again after a restart", "[explain]") {
  Bench bench(6'000.0);
  bench.run(600);
  {
    EvidenceFlow flow = bench.make();
    flow.start();
    bench.raise(flow);
    REQUIRE(Bench::wait([&] { return bench.board.snapshot(0).explanation != nullptr; }));
  }
  const long before = bench.runs();
  REQUIRE(before <= 2);
  bench.now_ms += 110;  // 660 s of the loop's time
  bench.history.emplace(3300.0, 1.0);
  EvidenceFlow flow = bench.make();
  flow.remember();
  flow.start();
  CHECK(Bench::done(flow, 2));
  CHECK(bench.runs() == before + 2);
}

}  // namespace loopwarden::daemon::evidence_flow_test
