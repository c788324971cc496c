// SPDX-License-Identifier: Apache-2.0
// The slip of a watched loop: the other controller makes the move, and the daemon's part for
// explanations finds it in the recording, judges it with the real `loopwarden` and closes the case.
// The alarm's explanation is prepared; the clock of the alarms is fake and searches are frequent.
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "daemon/app/evidence_flow.hpp"
#include "model/numeric/parallel.hpp"
#include "record/segment_ring.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "workbench/files/model_file.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "daemon/protocol/planned_test/planned_test.hpp"

namespace loopwarden::tests::watched_move_test {
namespace {

namespace fs = std::filesystem;
using namespace loopwarden::daemon;
using alarm::AlarmKind;

const std::string kExample = LOOPWARDEN_SOURCE_DIR "/examples/settle/";
constexpr double kPeriod_s = 0.1;

struct Rig {
  Rig() : plan(planned()) {
    write_file(folder / "explain",
               // Without idle priority, for a busy machine.
               "#!/bin/sh\nif [ \"$1\" = explain ]; then cp '" + (folder / "prepared").string() +
                   "'/* \"$3\"; exit; fi\nshift 2\n" LOOPWARDEN_CLI
                   " valve-test \"$@\" >/dev/null\ncode=$?\n[ $code = 0 ] || [ $code = 75 ]\n");
    fs::permissions(folder / "explain", fs::perms::owner_all);
    loops.front().config.name = "FIC-205";
    loops.front().config.sample_time_s = kPeriod_s;
    loops.front().config.monitor.twin = "twin.yaml";
    loops.front().config.recording.enabled = true;
    config.state_directory = folder.path();
    config.accelerate = 600.0;  // searches every 0.1 s
    specialists.twins.emplace("twin.yaml", twin);
    journal.open();
    journal.start();
  }

  // The plan of `gap`, as `explain` would write it.
  protocol::TestPlanFile planned() const {
    const std::string record = (folder / "record.csv").string();
    REQUIRE(run(LOOPWARDEN_CLI " simulate " + kExample + "plant.yaml --out " + record).exit_code ==
            0);
    REQUIRE(run(LOOPWARDEN_CLI " gap " + record + " --model " + kExample + "model.yaml --out " +
                (folder / "gap").string())
                .exit_code == 0);
    protocol::TestPlanFile made =
        workbench::usable(protocol::read_test_plan(folder / "gap/next_test.yaml"));
    made.loop = "FIC-205";
    made.model = "twin.yaml";
    const fs::path prepared = folder / "prepared";
    write_file(prepared / "next_test.yaml", protocol::write_test_plan(made));
    fs::copy(folder / "gap" / made.record, prepared / made.record);
    const nlohmann::json test = {{"text", "To decide: move SP."},
                                 {"planned_at", made.planned_at},
                                 {"valid_until_ms", 1000 * (made.planned_at + 86'400)}};
    const nlohmann::json explanation = {{"alarm", "model_gap"},
                                        {"final_name", nullptr},
                                        {"raised_ms", 1'800'000'000'000},
                                        {"ended_ms", 1'800'000'000'100},
                                        {"verdict", "missing_effect"},
                                        {"gap_closed", 0.9},
                                        {"agrees", true},
                                        {"from_s", nullptr},
                                        {"sentence", "Two causes are likely."},
                                        {"next_test", test},
                                        {"first", nullptr},
                                        {"effects", nlohmann::json::array()}};
    write_file(prepared / "explanation.json", explanation.dump());
    return made;
  }

  void start() {
    flow.emplace(config, specialists,
                 EvidenceFlow::Dependencies{.loops = loops,
                                            .alarms = alarms,
                                            .journal = journal,
                                            .config_hash = [] { return 1U; },
                                            .history = [this](std::size_t) { return &history; },
                                            .explain = folder / "explain"});
    flow->remember();
    flow->start();
  }
  void raise() {
    alarm::AlarmConditions conditions{};
    conditions[alarm::index_of(AlarmKind::model_gap)].on = true;
    alarms.of(0).twin_judged(conditions);
    flow->keep(0, AlarmKind::model_gap, monitor, {}, alarm::AlarmReason::twin);
  }
  // What the alarm's explanation shows about the test.
  bool shows(const std::string& text) const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(100);
    while (std::chrono::steady_clock::now() < until) {
      const auto found = alarms.snapshot(0).explanation;
      if (found && found->next_test.find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const auto found = alarms.snapshot(0).explanation;
    UNSCOPED_INFO((found ? found->next_test : "no explanation"));
    return false;
  }
  // Records a test with the rest before it, then some more rest.
  void records(const protocol::TestRecord& made) {
    std::vector<record::RecordRow> rows;
    constexpr std::size_t kMore = 200;
    for (std::size_t row = 0; row < made.pv.size() + kMore; ++row) {
      const std::size_t k = row < made.pv.size() ? row : row - made.pv.size();
      rows.push_back({.time_ns = begun_ns + static_cast<std::int64_t>(period * 100'000'000),
                      .period_index = period,
                      .sp = made.sp[k],
                      .pv = made.pv[k],
                      .co = made.co[k],
                      .mode = control::Mode::automatic});
      ++period;
    }
    segments.append(rows);
    record::SegmentWriter* const all = &segments;
    record::SegmentWriter::sync_all(std::span(&all, 1));
  }
  std::vector<journal::JournalEntry> tests_in_journal() const {
    std::vector<journal::JournalEntry> lines;
    for (const journal::JournalRow& row : journal.newest(100)) {
      if (row.entry.kind == journal::JournalEntry::Kind::test) lines.push_back(row.entry);
    }
    return lines;
  }

  TemporaryFolder folder;
  protocol::TestPlanFile plan;
  std::int64_t begun_ns = base::MonotonicClock().now_ns() + 2'000'000'000;
  std::uint64_t period = 1;
  record::SegmentWriter segments{
      {.folder = folder / "segments/FIC-205", .loop = "FIC-205", .period_s = kPeriod_s}};
  std::vector<LoopRuntime> loops{1};
  supervision::History history{3300.0, kPeriod_s};
  plant::LoopModel twin = workbench::load_model(kExample + "model.yaml");
  watch::LoopMonitor monitor{{.sample_time_s = kPeriod_s}, {}, nullptr, &twin};
  config::DaemonConfig config;
  config::Specialists specialists;
  journal::Journal journal{{.folder = folder / "journal"}};
  supervision::AlarmRegistry alarms{
      {{"FIC-205", 1.0}}, {}, journal, [] { return std::int64_t{1'800'000'000'000}; }};
  std::optional<EvidenceFlow> flow;
};

}  // namespace

TEST_CASE("the move of a slip is found in the recording and closes the case, across a restart",
          "[watch]") {
  Rig rig;
  rig.start();
  rig.raise();
  REQUIRE(rig.shows("open: the move was not seen yet"));

  protocol::TestPlanFile another = rig.plan;
  another.move = {estimator::MoveKind::set_point_pair, -6.0 * rig.plan.move.size, 30.0};
  const plant::LoopModel truth = workbench::load_model(kExample + "plant.yaml");
  rig.records(protocol::simulate_test(truth, another));
  REQUIRE(rig.shows("Another move than proposed was seen"));
  CHECK(rig.shows("open: the move was not seen yet"));

  rig.start();
  CHECK(rig.shows("Another move than proposed was seen"));
  rig.records(protocol::simulate_test(truth, rig.plan));
  REQUIRE(rig.shows("done: decided stiction"));

  rig.start();
  CHECK(rig.shows("done: decided stiction"));
  rig.flow.reset();
  rig.journal.stop();
  const std::vector<journal::JournalEntry> tests = rig.tests_in_journal();
  REQUIRE(tests.size() == 2);
  CHECK(tests[0].what == "test result");
  CHECK(tests[0].loop == "FIC-205");
  CHECK(tests[0].old_value.starts_with("stiction or deadband drive: 0.9"));
  CHECK(tests[0].new_value.starts_with("stiction: "));
  CHECK(tests[1].what == "test");
  CHECK(tests[1].new_value == "another move");
}

}  // namespace loopwarden::tests::watched_move_test
