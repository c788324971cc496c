// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/monitor.hpp"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/journal/incident_text.hpp"
#include "hal/contract/sample.hpp"
#include "model/alarm/limits.hpp"
#include "model/control/loop_controller.hpp"
#include "model/effects/stiction/stiction_karnopp.hpp"
#include "model/watch/limits.hpp"
#include "record/evidence/evidence.hpp"
#include "tests/model/diagnosis/signals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::supervision::monitor_test {
namespace {

using alarm::AlarmKind;
using alarm::AlarmState;
using alarm::WindowState;
using record::RecordRow;

// Returns the judgement that the test sets, and counts its calls.
class ScriptedJudge final : public alarm::WindowJudge {
 public:
  alarm::WindowJudgement judge(const alarm::Window& window) noexcept override {
    ++windows;
    last_pv = window.pv.back();
    return says;
  }
  alarm::WindowJudgement says;
  int windows = 0;
  double last_pv = 0.0;
};

alarm::WindowJudgement fault(AlarmKind kind, double severity) {
  alarm::WindowJudgement judgement;
  judgement.result = alarm::WindowJudgement::Result::fault;
  judgement.fault = kind;
  judgement.probability[alarm::index_of(kind)] = 0.97;
  judgement.severity_percent = severity;
  return judgement;
}

alarm::CorrectiveSettings planned_moves(bool on_order) {
  return {.enabled = true,
          .form = alarm::CorrectiveForm::planned_moves,
          .on_order = on_order,
          .max_move = 2.0,
          .max_moves_per_hour = 30.0};
}

// An explained stiction alarm with a known stick.
Explanation explained_at(std::int64_t utc_ms) {
  Explanation e;
  e.alarm = AlarmKind::stiction;
  e.raised_ms = e.ended_ms = utc_ms;
  e.effect = "stiction";
  e.stick = twin::Stick{
      .s = 0.8, .j = 0.3, .s_interval = {0.7, 0.9}, .j_interval = {}, .confidence = 0.9};
  return e;
}

constexpr std::uint64_t kWindow = alarm::kWindowSamples;

struct Bench {
  explicit Bench(std::size_t loops = 1, std::size_t ring = 1U << 15U) {
    std::vector<SupervisedLoop> names;
    for (std::size_t i = 0; i < loops; ++i) {
      rings.push_back(std::make_unique<base::SpscRing<RecordRow>>(ring));
      judges.push_back(std::make_unique<ScriptedJudge>());
      names.push_back({"FIC-" + std::to_string(101 + i), 0.1, "L/min"});
      next.push_back(1);
    }
    journal.open();
    journal.start();
    board = std::make_unique<AlarmRegistry>(names, alarm::AlarmSettings{}, journal,
                                            [this] { return now_ms; });
    make_monitor();
  }
  // `corrective`: for the first loop.
  void make_monitor(const alarm::CorrectiveSettings& corrective = {}) {
    std::vector<MonitoredLoop> monitored;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      monitored.push_back({.cycles = rings[i].get(),
                           .window = {.overlap = 0.0, .sample_time_s = 0.1},
                           .judge = judges[i].get(),
                           .rule = {.windows = 2, .windows_on = 2, .windows_off = 0}});
    }
    monitored.front().process = process;
    monitored.front().corrective = corrective;
    monitored.front().channels.commands = &desk;
    monitored.front().channels.settings_taken = &settings_taken;
    if (corrective.form == alarm::CorrectiveForm::planned_moves) {
      monitored.front().twin = &twin;
      monitored.front().history_s = 100.0;
      monitored.front().channels.moves_settings = &moves_settings;
      monitored.front().channels.moves = &moves;
      monitored.front().channels.hardware = true;
    }
    monitor = std::make_unique<Monitor>(monitored, *board);
  }
  RecordRow row(std::size_t loop) {
    RecordRow r;
    r.period_index = next[loop]++;
    r.sp = 50.0;
    r.pv = 50.0 + static_cast<double>(r.period_index % 7);
    r.co = 40.0 + static_cast<double>(r.period_index % 5);
    r.stem = r.co;
    r.mode = control::Mode::automatic;
    r.pv_quality = hal::Quality::good;
    return r;
  }
  void run(std::uint64_t cycles, std::size_t loop = 0) {
    for (std::uint64_t i = 0; i < cycles; ++i) {
      rings[loop]->try_push(row(loop));
      if (i % 200 == 199) monitor->round();
    }
    for (int i = 0; i < 8; ++i) monitor->round();
  }
  AlarmState state(AlarmKind kind, std::size_t loop = 0) const {
    return board->snapshot(loop).alarms.alarm(kind).state();
  }
  // Returns the lines of a kind, oldest first, as "from > to".
  std::vector<std::string> lines(AlarmKind kind) {
    journal.wait_written(journal.post({}), std::chrono::seconds(20));
    std::vector<std::string> texts;
    for (const journal::JournalRow& row : journal.newest(200)) {
      if (row.entry.kind != journal::JournalEntry::Kind::alarm) continue;
      if (row.entry.alarm != alarm::to_text(kind)) continue;
      texts.insert(texts.begin(), row.entry.from + " > " + row.entry.to);
    }
    return texts;
  }

  // Returns the reasons of a kind's lines, oldest first.
  std::vector<std::string> reasons(AlarmKind kind) {
    journal.wait_written(journal.post({}), std::chrono::seconds(20));
    std::vector<std::string> texts;
    for (const journal::JournalRow& row : journal.newest(200)) {
      if (row.entry.kind != journal::JournalEntry::Kind::alarm) continue;
      if (row.entry.alarm == alarm::to_text(kind)) texts.insert(texts.begin(), row.entry.reason);
    }
    return texts;
  }
  // Runs cycles of the first loop that `change` has spoilt.
  template <class Change>
  void run_spoilt(std::uint64_t cycles, Change change) {
    for (std::uint64_t i = 0; i < cycles; ++i) {
      RecordRow r = row(0);
      change(r);
      rings[0]->try_push(r);
      if (i % 200 == 199) monitor->round();
    }
    for (int i = 0; i < 8; ++i) monitor->round();
  }

  // Takes the given command as the loop does, and checks it.
  void answer(rt::MovesMode wish) {
    rt::Command order;
    REQUIRE(box.commands.try_pop(order));
    CHECK(order.moves == wish);
    CHECK_FALSE(order.jacket);
    box.answers.try_push({order.number, rt::Refusal::none});
    monitor->round();
  }

  // For the first loop.
  alarm::ProcessSettings process{.normal_mode = alarm::NormalMode::automatic, .limits = {}};
  tests::TemporaryFolder folder;
  std::int64_t now_ms = 1'800'000'000'000;
  journal::Journal journal{{.folder = folder.path()}};
  std::vector<std::unique_ptr<base::SpscRing<RecordRow>>> rings;
  std::vector<std::unique_ptr<ScriptedJudge>> judges;
  std::vector<std::uint64_t> next;
  // For the first loop.
  rt::CommandMailbox box;
  std::atomic<std::uint8_t> availability{0};
  std::atomic<std::uint32_t> settings_taken{0};
  plant::LoopModel twin;
  base::NewestValue<control::PlannedMovesSettings> moves_settings;
  rt::PlannedMovesStatus moves;
  commands::CommandQueue desk{
      box,
      availability,
      {.write_down = [this](journal::JournalEntry line) { return journal.post(std::move(line)); },
       .why = [](const rt::CommandAnswer& answer,
                 const rt::Command&) { return rt::to_text(answer.refusal); }}};
  std::unique_ptr<AlarmRegistry> board;
  std::unique_ptr<Monitor> monitor;
};

}  // namespace

TEST_CASE("an alarm of routine evidence is raised once, with the samples of that evidence",
          "[monitor]") {
  effects::StictionKarnopp valve({.s = 4.0, .j = 3.0}, 0.5);
  valve.reset(50.0);
  const auto run = tests::SmallLoop{.gain = 0.3, .integral_time = 2.0}.run(
      3 * watch::WatchLimits::kRoutineSamples, [&](double u) { return valve.step(u); },
      tests::wandering_load(1.3));
  Bench bench;
  // Samples of 2 s, and no specialists.
  std::vector<evidence::Evidence> raised;
  Monitor monitor({{.cycles = bench.rings[0].get(),
                    .window = {.sample_time_s = 2.0, .pv_low = -50.0, .co_high = 80.0},
                    .judge = nullptr,
                    .rule = {}}},
                  *bench.board,
                  [&](std::size_t loop, AlarmKind alarm, const watch::LoopMonitor& watched_by,
                      const watch::MonitorStep& step, alarm::AlarmReason reason) {
                    CHECK(loop == 0);
                    evidence::Evidence& e = raised.emplace_back();
                    e.alarm = alarm;
                    e.take(watched_by, step, reason);
                  });
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    RecordRow row = bench.row(0);
    row.sp = 20.0;
    row.pv = run.pv[k];
    row.co = run.co[k];
    REQUIRE(bench.rings[0]->try_push(row));
    if (k % 100 == 99) monitor.round();
  }
  for (int i = 0; i < 8; ++i) monitor.round();
  REQUIRE(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
  REQUIRE(raised.size() == 1);
  const evidence::Evidence& e = raised.front();
  CHECK(e.alarm == AlarmKind::stiction);
  REQUIRE(e.routine);
  CHECK(e.routine->verdict == diagnosis::DiagnosisVerdict::valve_effect);
  CHECK(e.routine->sum >= watch::WatchLimits::kRaise);
  CHECK(e.routine->severity_percent == Approx(100.0 * 4.0 / 80.0).epsilon(0.5));
  CHECK(e.sample_time_s == 2.0);
  CHECK(e.pv_low == -50.0);
  CHECK(e.co_high == 80.0);
  // The first two full windows of samples of one cycle.
  const std::size_t both = 2 * watch::WatchLimits::kRoutineSamples;
  REQUIRE(e.pv.size() == both);
  CHECK(e.pv.front() == Approx(run.pv.front()).epsilon(1e-6));
  CHECK(e.co.back() == Approx(run.co[both - 1]).epsilon(1e-6));
}

TEST_CASE("a fault in enough windows is an alarm, and clears when the valve is repaired",
          "[monitor]") {
  Bench bench;
  bench.run(2 * kWindow);
  CHECK(bench.judges[0]->windows == 2);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::normal);
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(kWindow);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::normal);  // one window raises no alarm
  bench.run(kWindow);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
  CHECK(bench.board->snapshot(0).alarms.alarm(AlarmKind::stiction).memory().severity_percent ==
        6.0);
  REQUIRE(bench.board->act(0, {AlarmKind::stiction, alarm::AlarmAction::acknowledge, 0, "me", {}})
              .accepted);
  bench.judges[0]->says = {};
  bench.run(2 * kWindow);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::normal);
  CHECK(bench.lines(AlarmKind::stiction) ==
        std::vector<std::string>{"normal > unacknowledged", "unacknowledged > acknowledged",
                                 "acknowledged > normal"});
  CHECK(bench.board->snapshot(0).windows == 6);
}

TEST_CASE("a lost device raises process alarms, with their reasons in the journal", "[monitor]") {
  const auto lost = [](RecordRow& row) {
    row.pv = std::nan("");
    row.pv_quality = hal::Quality::bad;
    row.pv_reason = hal::Reason::link_lost;
    row.flags |= record::kOutputLost;
    row.fault = control::Fault::output_lost;
    row.mode = control::Mode::fallback;
  };
  Bench bench;
  bench.run(20);
  bench.run_spoilt(100, lost);
  CHECK(bench.state(AlarmKind::bad_pv) == AlarmState::normal);
  bench.run_spoilt(1, lost);
  for (const AlarmKind kind : {AlarmKind::bad_pv, AlarmKind::output_lost}) {
    CHECK(bench.state(kind) == AlarmState::unacknowledged);
  }
  for (const AlarmKind kind : {AlarmKind::not_normal_mode, AlarmKind::output_unknown}) {
    CHECK(bench.state(kind) == AlarmState::suppressed);
  }
  CHECK(bench.reasons(AlarmKind::bad_pv) == std::vector<std::string>{"PV is bad: link lost"});
  CHECK(bench.reasons(AlarmKind::output_lost) ==
        std::vector<std::string>{"commands don't reach the device; PV is bad: link lost"});
  CHECK(bench.reasons(AlarmKind::not_normal_mode).empty());

  REQUIRE(bench.board->act(0, {AlarmKind::bad_pv, alarm::AlarmAction::acknowledge, 0, "me", {}})
              .accepted);
  SECTION("they clear when the loop works again, each with its reason") {
    bench.run(601);
    CHECK(bench.state(AlarmKind::bad_pv) == AlarmState::normal);
    CHECK(bench.state(AlarmKind::output_lost) == AlarmState::returned_unacknowledged);
    CHECK(bench.reasons(AlarmKind::bad_pv).back() == "PV is good");
    CHECK(bench.reasons(AlarmKind::output_lost).back() == "commands reach the device");
    CHECK(bench.state(AlarmKind::not_normal_mode) == AlarmState::normal);
  }
  SECTION("a consequence is raised once it is an alarm without its cause") {
    bench.run_spoilt(601, [](RecordRow& row) { row.mode = control::Mode::manual; });
    CHECK(bench.state(AlarmKind::output_lost) == AlarmState::returned_unacknowledged);
    CHECK(bench.state(AlarmKind::not_normal_mode) == AlarmState::unacknowledged);
    CHECK(bench.reasons(AlarmKind::not_normal_mode).back() == "what it followed from has gone");
  }
  SECTION("a restart keeps them, and they are not raised again") {
    bench.make_monitor();
    bench.run_spoilt(300, lost);
    CHECK(bench.state(AlarmKind::bad_pv) == AlarmState::acknowledged);
    CHECK(bench.state(AlarmKind::output_lost) == AlarmState::unacknowledged);
    CHECK(bench.lines(AlarmKind::bad_pv).size() == 2);
    bench.run(601);
    CHECK(bench.state(AlarmKind::bad_pv) == AlarmState::normal);
  }
}

TEST_CASE("a limit alarm has the limit and PV; a deviation is off in manual", "[monitor]") {
  Bench bench;
  bench.process.at(AlarmKind::pv_high).fitted = true;
  bench.process.limits.at(AlarmKind::pv_high) = {60.0, 1.0};
  bench.process.at(AlarmKind::deviation).fitted = true;
  bench.process.limits.at(AlarmKind::deviation) = {5.0, 0.5};
  bench.monitor.reset();
  bench.board = std::make_unique<AlarmRegistry>(
      std::vector<SupervisedLoop>{{.name = "FIC-101",
                                   .fitted = {AlarmKind::pv_high, AlarmKind::deviation},
                                   .priority = {{AlarmKind::pv_high, alarm::Priority::critical}}}},
      alarm::AlarmSettings{}, bench.journal, [&] { return bench.now_ms; });
  bench.make_monitor();
  const auto high = [](RecordRow& row) {
    row.pv = 61.5;
    row.sp = 50.0;
    row.mode = control::Mode::automatic;
  };
  bench.run_spoilt(101, high);
  CHECK(bench.state(AlarmKind::pv_high) == AlarmState::unacknowledged);
  CHECK(bench.reasons(AlarmKind::pv_high) == std::vector<std::string>{"PV 61.5, limit 60 "});
  CHECK(bench.state(AlarmKind::deviation) == AlarmState::unacknowledged);
  CHECK(bench.board->snapshot(0).priority[alarm::index_of(AlarmKind::pv_high)] ==
        alarm::Priority::critical);
  CHECK(bench.board->snapshot(0).flaps[alarm::index_of(AlarmKind::pv_high)] == 1);
  bench.run_spoilt(610, [&](RecordRow& row) {
    high(row);
    row.mode = control::Mode::manual;
  });
  CHECK(bench.state(AlarmKind::deviation) == AlarmState::returned_unacknowledged);
  CHECK_FALSE(bench.board->act(0, {AlarmKind::pv_low, alarm::AlarmAction::acknowledge, 0, "me", {}})
                  .accepted);
}

TEST_CASE("each loop has its own process alarms, with or without specialists", "[monitor]") {
  Bench bench(2);
  Monitor monitor({{.cycles = bench.rings[0].get(), .window = {.sample_time_s = 0.1}, .rule = {}},
                   {.cycles = bench.rings[1].get(),
                    .window = {.sample_time_s = 0.1},
                    .rule = {},
                    .process = {.normal_mode = alarm::NormalMode::manual, .limits = {}}}},
                  *bench.board);
  for (int i = 0; i <= 100; ++i) {
    RecordRow unknown = bench.row(0);
    unknown.fault = control::Fault::output_unknown;
    REQUIRE(bench.rings[0]->try_push(unknown));
    REQUIRE(bench.rings[1]->try_push(bench.row(1)));
  }
  monitor.round();
  CHECK(bench.state(AlarmKind::output_unknown, 0) == AlarmState::unacknowledged);
  CHECK(bench.state(AlarmKind::not_normal_mode, 0) == AlarmState::suppressed);
  CHECK(bench.state(AlarmKind::output_unknown, 1) == AlarmState::normal);
  CHECK(bench.state(AlarmKind::not_normal_mode, 1) == AlarmState::unacknowledged);
  CHECK(bench.reasons(AlarmKind::not_normal_mode).front() == "AUTO; the normal mode is manual");
  CHECK(bench.reasons(AlarmKind::output_unknown).front() == "output position unknown");
}

TEST_CASE("the journal has the reason why an alarm was raised or cleared", "[monitor]") {
  Bench bench;
  alarm::AlarmConditions conditions{};
  const auto twin = [&](bool on) {
    conditions[alarm::index_of(AlarmKind::model_gap)].on = on;
    bench.board->of(0).twin_judged(conditions);
  };
  twin(true);
  twin(false);
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(2 * kWindow);
  bench.judges[0]->says = {};
  bench.run(2 * kWindow);
  REQUIRE(bench.journal.wait_written(bench.journal.post({}), std::chrono::seconds(60)));
  std::vector<std::string> reasons;
  for (const journal::JournalRow& row : bench.journal.newest(10)) {
    if (row.entry.kind == journal::JournalEntry::Kind::alarm) {
      reasons.insert(reasons.begin(), row.entry.reason);
    }
  }
  CHECK(reasons == std::vector<std::string>{"twin: what it predicts of PV no longer comes",
                                            "twin: PV comes as it predicts again", "",
                                            "windows: they no longer show it"});
}

TEST_CASE(
    "no window across manual, bad PV or a gap; alarms that are off are shown as unable to be "
    "raised",
    "[monitor]") {
  Bench bench;
  bench.run(kWindow);
  REQUIRE(bench.state(AlarmKind::stiction) == AlarmState::normal);
  bench.run(kWindow - 10);
  RecordRow broken = bench.row(0);
  WindowState why = WindowState::valid;
  SECTION("manual") {
    broken.mode = control::Mode::manual;
    why = WindowState::not_automatic;
  }
  SECTION("bad PV") {
    broken.pv_quality = hal::Quality::bad;
    why = WindowState::bad_pv;
  }
  SECTION("uncertain PV") {
    broken.pv_quality = hal::Quality::uncertain;
    why = WindowState::bad_pv;
  }
  SECTION("a gap") {
    bench.next[0] += watch::WatchLimits::kLongestBridge;
    broken.period_index = bench.next[0]++;
    why = WindowState::gap;
  }
  bench.rings[0]->try_push(broken);
  bench.monitor->round();
  CHECK(bench.board->snapshot(0).window_state == why);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::suppressed);
  bench.run(kWindow - 1 - (why == WindowState::gap ? 1 : 0));
  CHECK(bench.judges[0]->windows == 1);
  bench.run(1);
  CHECK(bench.judges[0]->windows == 2);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::normal);
}

TEST_CASE("a saturated window is not judged, and is counted", "[monitor]") {
  Bench bench;
  for (std::uint64_t i = 0; i < kWindow; ++i) {
    RecordRow row = bench.row(0);
    if (i < 120) row.co = 100.0;
    bench.rings[0]->try_push(row);
  }
  for (int i = 0; i < 8; ++i) bench.monitor->round();
  CHECK(bench.judges[0]->windows == 0);
  const AlarmSnapshot watch = bench.board->snapshot(0);
  CHECK(watch.window_state == WindowState::saturated);
  CHECK(watch.windows_suppressed == 1);
  CHECK(watch.measures.saturated_percent == Approx(100.0 * 120 / 961));
}

TEST_CASE("without specialists the classical measures are available", "[monitor]") {
  Bench bench;
  std::vector<MonitoredLoop> monitored{{.cycles = bench.rings[0].get(),
                                        .window = {.overlap = 0.0, .sample_time_s = 0.1},
                                        .judge = nullptr,
                                        .rule = {}}};
  bench.monitor = std::make_unique<Monitor>(std::move(monitored), *bench.board);
  bench.run(kWindow);
  const AlarmSnapshot watch = bench.board->snapshot(0);
  CHECK(watch.window_state == WindowState::no_judge);
  CHECK(watch.measures.variability_percent > 0.0);
  CHECK(watch.times.seconds_in(control::Mode::automatic) == Approx(96.1));
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::suppressed);
}

TEST_CASE("not enough movement changes no condition", "[monitor]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::backlash, 5.0);
  bench.run(2 * kWindow);
  REQUIRE(bench.state(AlarmKind::backlash) == AlarmState::unacknowledged);
  bench.judges[0]->says = {};
  bench.judges[0]->says.result = alarm::WindowJudgement::Result::not_enough_movement;
  bench.run(5 * kWindow);
  CHECK(bench.state(AlarmKind::backlash) == AlarmState::unacknowledged);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::suppressed);
  CHECK(bench.board->snapshot(0).windows_suppressed == 5);
}

TEST_CASE("an acknowledged alarm stays acknowledged over a restart", "[monitor]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::stiction, 5.0);
  bench.run(2 * kWindow);
  const auto done =
      bench.board->act(0, {AlarmKind::stiction, alarm::AlarmAction::acknowledge, 0, "me", {}});
  REQUIRE(bench.journal.wait_written(done.ticket, std::chrono::seconds(20)));
  bench.journal.stop();

  journal::Journal again({.folder = bench.folder.path()});
  AlarmRegistry board({{"FIC-101", 0.1}}, {}, again, [&] { return bench.now_ms; });
  board.restore(again.open());
  CHECK(board.snapshot(0).alarms.alarm(AlarmKind::stiction).state() == AlarmState::acknowledged);
  std::vector<MonitoredLoop> monitored{{.cycles = bench.rings[0].get(),
                                        .window = {.overlap = 0.0, .sample_time_s = 0.1},
                                        .judge = bench.judges[0].get(),
                                        .rule = {.windows = 2, .windows_on = 2, .windows_off = 0}}};
  bench.monitor = std::make_unique<Monitor>(std::move(monitored), board);
  bench.run(kWindow);  // the first window alone would be no alarm
  CHECK(board.snapshot(0).alarms.alarm(AlarmKind::stiction).state() == AlarmState::acknowledged);
  bench.monitor.reset();  // before its registry
}

TEST_CASE("all waiting alarms are acknowledged at once, no other, without waiting for the disk",
          "[monitor]") {
  tests::TemporaryFolder folder;
  journal::Journal journal({.folder = folder.path()});  // not started: its disk never answers
  std::vector<SupervisedLoop> loops;
  for (int i = 0; i < 60; ++i) loops.push_back({"FIC-" + std::to_string(i), 0.1});
  AlarmRegistry board(loops, {}, journal, [] { return std::int64_t{1'800'000'000'000}; });
  alarm::AlarmConditions on{};
  on[alarm::index_of(AlarmKind::stiction)] = {true, 5.0};
  for (std::size_t i = 1; i < 60; ++i) board.of(i).window_judged({}, {}, on);
  REQUIRE(
      board.act(7, {AlarmKind::stiction, alarm::AlarmAction::shelve, 60'000, "me", {}}).accepted);

  // One of a kind that was not meant.
  board.of(3).process_changed(std::vector<ProcessNews>{{{AlarmKind::bad_pv, true}, "PV is bad"}});

  const Acknowledged done = board.acknowledge_all(alarm::kValveAlarms, "10.0.0.7:1000", "seen");
  CHECK(done.alarms.size() == 58);
  for (std::size_t i = 0; i < 60; ++i) {
    const alarm::LoopAlarms& alarms = board.snapshot(i).alarms;
    const bool waits =
        std::any_of(alarm::kAlarmKinds.begin(), alarm::kAlarmKinds.end(),
                    [&](alarm::AlarmKind kind) { return alarms.alarm(kind).unacknowledged(); });
    CHECK(waits == (i == 3));
    const AlarmState state = board.snapshot(i).alarms.alarm(AlarmKind::stiction).state();
    CHECK(state == (i == 0   ? AlarmState::suppressed
                    : i == 7 ? AlarmState::shelved
                             : AlarmState::acknowledged));
  }
  CHECK(journal.written(done.ticket) == journal::Written::not_yet);
  // The last of all lines: a caller that waits for it waits once.
  CHECK(done.ticket == journal.post({}) - 1);
  CHECK(board.acknowledge_all(alarm::kValveAlarms, "10.0.0.7:1000", {}).alarms.empty());
  CHECK(board.acknowledge_all(alarm::kAlarmKinds, "10.0.0.7:1000", {}).alarms.size() == 1);
}

TEST_CASE(
    "the alarms of one change are one incident: reported, acknowledged, and kept over a restart",
    "[monitor][incident]") {
  Bench bench;
  const auto incident = [&](const AlarmRegistry& board) {
    return board.snapshot(0).incident.incident();
  };
  bench.judges[0]->says = fault(AlarmKind::stiction, 5.0);
  bench.run(2 * kWindow);
  alarm::AlarmConditions twin{};
  twin[alarm::index_of(AlarmKind::stiction)] = {true, 5.0};
  twin[alarm::index_of(AlarmKind::model_gap)] = {true, 0.0};
  bench.board->of(0).twin_judged(twin);
  CHECK(incident(*bench.board).has(AlarmKind::stiction));
  CHECK(incident(*bench.board).has(AlarmKind::model_gap));
  const std::string id = journal::incident_id("FIC-101", incident(*bench.board));
  CHECK(id == "FIC-101-20270115T080000Z");

  CHECK_THAT(bench.board->of(0).acknowledge_incident("FIC-101-20260101T000000Z", "me", {}).why,
             Catch::Contains(id));
  const CommandResult done = bench.board->of(0).acknowledge_incident(id, "me", "seen");
  REQUIRE(done.accepted);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::acknowledged);
  CHECK(bench.state(AlarmKind::model_gap) == AlarmState::acknowledged);
  CHECK_FALSE(bench.board->of(0).acknowledge_incident(id, "me", {}).accepted);

  Explanation e;
  e.alarm = AlarmKind::model_gap;
  e.raised_ms = bench.now_ms;
  e.verdict = "missing_effect";
  e.effect = "gain_change";
  e.block = effects::Block::process;
  e.confidence = 0.9;
  bench.board->of(0).explained(e);
  bench.journal.wait_written(bench.journal.post({}), std::chrono::seconds(20));
  std::vector<std::string> told;
  for (const journal::JournalRow& row : bench.journal.newest(200)) {
    if (row.entry.what.rfind("incident", 0) != 0) continue;
    told.push_back(row.entry.what + " " + row.entry.old_value + ">" + row.entry.new_value);
    CHECK(row.entry.reason == id);
  }
  CHECK(told == std::vector<std::string>{"incident renamed stiction>gain_change",
                                         "incident joined >stiction", "incident opened >stiction"});

  bench.journal.stop();
  for (const bool damaged : {false, true}) {
    INFO((damaged ? "the journal is damaged: from the copy" : "from the journal"));
    if (damaged) tests::write_file(bench.folder / "journal.sqlite", "no database");
    journal::Journal again({.folder = bench.folder.path()});
    AlarmRegistry board({{"FIC-101", 0.1}}, {}, again, [&] { return bench.now_ms; });
    board.restore(again.open());
    CHECK(incident(board).name == "gain_change");
    CHECK(incident(board).cause == effects::Block::process);
    CHECK(incident(board).alarms == incident(*bench.board).alarms);
    CHECK(incident(board).opened_ms == incident(*bench.board).opened_ms);
    CHECK(incident(board).renamed == incident(*bench.board).renamed);
    CHECK(incident(board).open());
  }

  bench.now_ms += alarm::AlarmLimits::kQuiet_ms + alarm::AlarmLimits::kJoin_ms;
  bench.board->of(0).twin_judged({});
  bench.board->of(0).pass_time();
  CHECK(incident(*bench.board).open());
  bench.now_ms += alarm::AlarmLimits::kQuiet_ms;
  bench.board->of(0).pass_time();
  CHECK_FALSE(incident(*bench.board).open());
}

TEST_CASE("a shelved alarm returns by itself after its time", "[monitor]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::stiction, 5.0);
  bench.run(2 * kWindow);
  REQUIRE(bench.board->act(0, {AlarmKind::stiction, alarm::AlarmAction::shelve, 60'000, "me", "x"})
              .accepted);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::shelved);
  bench.now_ms += 59'999;
  bench.monitor->round();
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::shelved);
  bench.now_ms += 1;
  bench.monitor->round();
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
}

TEST_CASE("loops are served in turn: a long queue of one does not keep the others waiting",
          "[monitor]") {
  Bench bench(3);
  // Four windows wait in the first loop, one in each of the others.
  for (std::uint64_t i = 0; i < 4 * kWindow; ++i) bench.rings[0]->try_push(bench.row(0));
  for (std::size_t loop : {1U, 2U}) {
    for (std::uint64_t i = 0; i < kWindow; ++i) bench.rings[loop]->try_push(bench.row(loop));
  }
  const auto rounds = static_cast<int>(kWindow / LoopSupervisor::kCyclesATurn + 1);
  for (int i = 0; i < rounds; ++i) bench.monitor->round();
  CHECK(bench.judges[0]->windows == 1);
  CHECK(bench.judges[1]->windows == 1);
  CHECK(bench.judges[2]->windows == 1);
  bench.monitor->round();
  CHECK(bench.monitor->status().backlog == 1);
  for (int i = 0; i < 4 * rounds; ++i) bench.monitor->round();
  CHECK(bench.judges[0]->windows == 4);
  CHECK(bench.monitor->status().backlog == 0);
  CHECK(bench.monitor->status().windows == 6);
}

TEST_CASE("corrective action: journalled with the loop's answer, and given up if refused",
          "[monitor][corrective]") {
  Bench bench;
  bench.make_monitor({.enabled = true});
  const auto written = [&] {
    bench.journal.wait_written(bench.journal.post({}), std::chrono::seconds(20));
    std::vector<std::string> lines;
    for (const journal::JournalRow& row : bench.journal.newest(200)) {
      const journal::JournalEntry& e = row.entry;
      if (e.kind != journal::JournalEntry::Kind::system || e.loop.empty()) continue;
      if (e.what == "incident opened") continue;
      lines.insert(lines.begin(),
                   e.what + ": " + e.old_value + " > " + e.new_value + ": " + e.result);
    }
    return lines;
  };
  const auto corrective = [&] { return bench.board->snapshot(0).corrective; };
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run((2 + alarm::AlarmLimits::kBaseline) * kWindow);
  REQUIRE(corrective() == alarm::CorrectiveState::trying);
  rt::CommandMailbox& box = bench.box;
  rt::Command order;
  REQUIRE(box.commands.try_pop(order));
  CHECK(order.jacket == rt::JacketMode::on);
  CHECK(written().empty());  // nobody knows yet what came of it

  SECTION("refused: a reload has taken the jacket away") {
    box.answers.try_push({order.number, rt::Refusal::no_jacket});
    bench.monitor->round();
    CHECK(corrective() == alarm::CorrectiveState::given_up);
    CHECK(written() ==
          std::vector<std::string>{
              "jacket on: waiting > trying: refused: the loop has no jacket configured",
              "corrective action: trying > given up: done"});
    CHECK_FALSE(box.commands.try_pop(order));
    bench.run(2 * alarm::AlarmLimits::kBaseline * kWindow);
    CHECK_FALSE(box.commands.try_pop(order));  // not again for this alarm
  }
  SECTION("done") {
    box.answers.try_push({order.number, rt::Refusal::none});
    bench.monitor->round();
    CHECK(corrective() == alarm::CorrectiveState::trying);
    CHECK(written() == std::vector<std::string>{"jacket on: waiting > trying: done"});
  }
  SECTION("a reload sets the jacket as its file has it, in shadow") {
    // `on` may be answered or underway: the loop takes settings before commands.
    const bool answered = GENERATE(true, false);
    if (answered) box.answers.try_push({order.number, rt::Refusal::none});
    ++bench.settings_taken;
    bench.monitor->round();
    CHECK(corrective() == alarm::CorrectiveState::waiting);
    if (!answered) box.answers.try_push({order.number, rt::Refusal::none});
    REQUIRE(box.commands.try_pop(order));
    CHECK(order.jacket == rt::JacketMode::shadow);
    box.answers.try_push({order.number, rt::Refusal::none});
    bench.monitor->round();
    CHECK(written() == std::vector<std::string>{"jacket on: waiting > trying: done",
                                                "jacket back to shadow: trying > waiting: done"});
    // The valve still sticks: once more, from a new baseline.
    bench.run((alarm::AlarmLimits::kBaseline - 1) * kWindow);
    CHECK_FALSE(box.commands.try_pop(order));
    bench.run(kWindow);
    REQUIRE(box.commands.try_pop(order));
    CHECK(order.jacket == rt::JacketMode::on);
  }
  SECTION("the loop ends before it answers") {
    bench.monitor->stop();
    CHECK(written() == std::vector<std::string>{
                           "jacket on: waiting > trying: not taken: the daemon ended before the "
                           "loop's next cycle"});
  }
}

TEST_CASE("planned moves: from the explained alarm through a shadow to a steady loop",
          "[monitor][corrective]") {
  Bench bench;
  const bool on_order = GENERATE(false, true);
  bench.make_monitor(planned_moves(on_order));
  const auto corrective = [&] { return bench.board->snapshot(0).corrective; };
  rt::Command order;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(3 * kWindow);
  CHECK(corrective() == alarm::CorrectiveState::waiting);
  CHECK_FALSE(bench.board->of(0).begin_offered("anna", "").accepted);

  const Explanation e = explained_at(bench.now_ms);
  bench.board->of(0).explained(e);
  bench.run(kWindow);
  if (on_order) {
    CHECK(corrective() == alarm::CorrectiveState::offered);
    CHECK_FALSE(bench.box.commands.try_pop(order));
    CHECK(bench.board->of(0).begin_offered("anna", "until the shutdown").accepted);
    bench.monitor->round();
  }
  bench.answer(rt::MovesMode::shadow);
  CHECK(corrective() == alarm::CorrectiveState::in_shadow);
  const control::PlannedMovesSettings settings = bench.moves_settings.newest();
  CHECK(settings.gain == bench.twin.process.gain);
  CHECK(settings.s == 0.8);
  CHECK(settings.s_high == 0.9);
  CHECK(settings.max_move == 2.0);

  bench.moves.publish({.phase = control::MovePhase::resting, .gain = 0.25, .shadow = true});
  bench.run(7 * kWindow);  // 673 s
  bench.answer(rt::MovesMode::on);
  CHECK(corrective() == alarm::CorrectiveState::trying);

  // The windows no longer show the valve. The alarm stays on nevertheless.
  bench.moves.publish({.phase = control::MovePhase::resting, .gain = 0.3});
  bench.judges[0]->says = {};
  bench.judges[0]->says.result = GENERATE(alarm::WindowJudgement::Result::no_fault,
                                          alarm::WindowJudgement::Result::not_enough_movement);
  bench.run(5 * kWindow);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);

  // Repaired: the stem follows a probe, and windows judge the valve again.
  bench.moves.publish({.phase = control::MovePhase::disengaged,
                       .reason = control::DisengageReason::valve_follows,
                       .latched = true});
  bench.run(1);
  bench.answer(rt::MovesMode::off);
  CHECK(corrective() == alarm::CorrectiveState::waiting);
  bench.moves.clear();
  bench.judges[0]->says.result = alarm::WindowJudgement::Result::no_fault;
  bench.run(3 * kWindow);
  CHECK_FALSE(bench.board->snapshot(0).alarms.alarm(AlarmKind::stiction).active());
  CHECK_FALSE(bench.box.commands.try_pop(order));
}

TEST_CASE("an explanation of an alarm from before the start begins no planned moves",
          "[monitor][corrective]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(3 * kWindow);
  const Explanation e = explained_at(bench.now_ms);
  bench.now_ms += 1000;
  const bool on_order = GENERATE(false, true);
  bench.make_monitor(planned_moves(on_order));
  // As the daemon does once all is made.
  bench.board->of(0).restore(e);
  bench.run(3 * kWindow);
  rt::Command order;
  CHECK_FALSE(bench.box.commands.try_pop(order));
  CHECK(bench.board->snapshot(0).corrective ==
        (on_order ? alarm::CorrectiveState::offered : alarm::CorrectiveState::waiting));
}

TEST_CASE("a clock that is set back changes no name and delays no planned moves",
          "[monitor][corrective][incident]") {
  constexpr std::int64_t kYear_ms = 365LL * 24 * 3'600'000;
  Bench bench;
  const bool open_before = GENERATE(false, true);
  bench.now_ms += kYear_ms;
  bench.make_monitor(planned_moves(false));
  bench.judges[0]->says = fault(AlarmKind::backlash, 6.0);
  if (open_before) bench.run(3 * kWindow);
  bench.now_ms -= kYear_ms;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(4 * kWindow);
  REQUIRE(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);

  Explanation e = explained_at(bench.now_ms);
  e.block = effects::Block::valve;
  e.confidence = 0.9;
  bench.board->of(0).explained(e);
  CHECK(bench.board->snapshot(0).incident.incident().name == "stiction");
  bench.run(kWindow);
  bench.answer(rt::MovesMode::shadow);
  CHECK(bench.board->snapshot(0).corrective == alarm::CorrectiveState::in_shadow);
}

TEST_CASE("planned moves follow the newest explanation of the incident", "[monitor][corrective]") {
  Bench bench;
  const bool on_order = GENERATE(false, true);
  bench.make_monitor(planned_moves(on_order));
  const auto corrective = [&] { return bench.board->snapshot(0).corrective; };
  rt::Command order;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(3 * kWindow);
  Explanation earlier = explained_at(bench.now_ms);
  --earlier.raised_ms;
  earlier.final_name = AlarmKind::model_gap;
  // Of the incident before this one.
  bench.board->of(0).explained(earlier);
  bench.run(kWindow);
  CHECK(corrective() == alarm::CorrectiveState::waiting);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);

  Explanation e = earlier;
  e.raised_ms = bench.now_ms;
  e.final_name.reset();
  bench.board->of(0).explained(e);
  bench.run(kWindow);
  Explanation other = e;
  other.effect = "backlash";
  other.stick.reset();
  if (on_order) {
    REQUIRE(corrective() == alarm::CorrectiveState::offered);
    bench.board->of(0).explained(other);
    bench.monitor->round();
    CHECK(corrective() == alarm::CorrectiveState::waiting);
    CHECK_FALSE(bench.board->of(0).begin_offered("anna", "").accepted);
    CHECK_FALSE(bench.box.commands.try_pop(order));
    return;
  }
  bench.answer(rt::MovesMode::shadow);
  CHECK(bench.moves_settings.newest().s == 0.8);
  // A new explanation while they are in shadow.
  e.stick->s = 0.7;
  bench.board->of(0).explained(e);
  bench.monitor->round();
  bench.answer(rt::MovesMode::shadow);
  CHECK(bench.moves_settings.newest().s == 0.7);
  bench.monitor->round();
  CHECK_FALSE(bench.box.commands.try_pop(order));
  bench.board->of(0).explained(other);
  bench.monitor->round();
  bench.answer(rt::MovesMode::off);
  CHECK(corrective() == alarm::CorrectiveState::waiting);
}

TEST_CASE("planned moves stay in shadow on hardware if s is known too roughly",
          "[monitor][corrective]") {
  Bench bench;
  bench.make_monitor({.enabled = true, .form = alarm::CorrectiveForm::planned_moves});
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(3 * kWindow);
  Explanation e = explained_at(bench.now_ms);
  e.stick->s_interval = {0.4, 0.9};
  bench.board->of(0).explained(e);
  bench.run(kWindow);
  bench.answer(rt::MovesMode::shadow);
  bench.moves.publish({.phase = control::MovePhase::resting, .gain = 0.25, .shadow = true});
  bench.run(10 * kWindow);
  CHECK(bench.board->snapshot(0).corrective == alarm::CorrectiveState::in_shadow);
  rt::Command order;
  CHECK_FALSE(bench.box.commands.try_pop(order));
}

TEST_CASE("rows that the ring had no room for are counted and break the window", "[monitor]") {
  Bench bench(1, 64);
  for (int i = 0; i < 100; ++i) bench.rings[0]->try_push(bench.row(0));
  bench.monitor->round();
  CHECK(bench.monitor->status().dropped == 36);
  CHECK(bench.monitor->status().cycles == 64);
  bench.rings[0]->try_push(bench.row(0));
  bench.monitor->round();
  CHECK(bench.board->snapshot(0).window_state == WindowState::gap);
}

TEST_CASE("500 loops on one thread", "[monitor]") {
  Bench bench(500, 256);
  for (std::uint64_t chunk = 0; chunk < kWindow; chunk += 100) {
    for (std::size_t loop = 0; loop < 500; ++loop) {
      for (std::uint64_t i = chunk; i < std::min(chunk + 100, kWindow); ++i) {
        bench.rings[loop]->try_push(bench.row(loop));
      }
    }
    bench.monitor->round();
  }
  CHECK(bench.monitor->status().dropped == 0);
  CHECK(bench.monitor->status().windows == 500);
}

TEST_CASE("an explanation is kept with the alarm, and renames it if it is sure",
          "[monitor][explain]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(2 * kWindow);
  REQUIRE(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
  Explanation e;
  e.alarm = AlarmKind::stiction;
  e.raised_ms = bench.now_ms;
  e.verdict = "missing_effect";
  e.effect = "backlash";
  e.agrees = false;
  e.sentence = "The record fits a play.";
  bench.board->of(0).explained(e);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
  REQUIRE(bench.board->snapshot(0).explanation);
  CHECK(bench.board->snapshot(0).explanation->effect == "backlash");

  e.effect = "gain_change";
  e.final_name = AlarmKind::model_gap;
  e.agrees = true;
  bench.board->of(0).explained(e);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::normal);
  CHECK(bench.state(AlarmKind::model_gap) == AlarmState::unacknowledged);
  // The same condition continues: it belongs to the other alarm now.
  bench.run(kWindow);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::normal);
  CHECK(bench.state(AlarmKind::model_gap) == AlarmState::unacknowledged);
  CHECK(bench.lines(AlarmKind::stiction) ==
        std::vector<std::string>{"normal > unacknowledged", "unacknowledged > normal"});
  std::vector<std::string> said;
  for (const journal::JournalRow& row : bench.journal.newest(200)) {
    if (row.entry.what == "explanation") said.push_back(row.entry.new_value + row.entry.result);
  }
  CHECK(said == std::vector<std::string>{"gain_changeagrees", "backlashdoes not agree"});
}

TEST_CASE("an alarm whose stick the read-back shows is not renamed to learned",
          "[monitor][explain]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(2 * kWindow);
  REQUIRE(alarm::shows_stick(bench.board->snapshot(0).measures));
  Explanation e;
  e.alarm = AlarmKind::stiction;
  e.raised_ms = bench.now_ms;
  e.verdict = "missing_effect";
  e.effect = "learned";
  e.block = effects::Block::valve;
  e.confidence = 0.95;
  e.gap_closed = 0.95;
  e.final_name = AlarmKind::unknown;
  bench.board->of(0).explained(e);
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
  CHECK(bench.state(AlarmKind::unknown) == AlarmState::normal);
  CHECK(bench.board->snapshot(0).incident.incident().name == "stiction");
  CHECK_FALSE(bench.board->snapshot(0).explanation->final_name);
}

TEST_CASE("a new explanation has a journal line if its name is different", "[monitor][explain]") {
  Bench bench;
  bench.judges[0]->says = fault(AlarmKind::stiction, 6.0);
  bench.run(2 * kWindow);
  const auto lines = [&](const std::string& what) {
    bench.journal.wait_written(bench.journal.post({}), std::chrono::seconds(20));
    const auto rows = bench.journal.newest(200);
    return std::count_if(rows.begin(), rows.end(),
                         [&](const auto& row) { return row.entry.what == what; });
  };
  Explanation e;
  e.alarm = AlarmKind::stiction;
  e.raised_ms = bench.now_ms;
  e.verdict = "missing_effect";
  e.effect = "gain_change";
  e.block = effects::Block::process;
  e.confidence = 0.94;
  e.final_name = AlarmKind::model_gap;
  bench.board->of(0).explained(e);
  e.confidence = 0.96;
  bench.board->of(0).explained(e);
  CHECK(lines("explanation") == 1);
  CHECK(lines("incident renamed") == 1);
  CHECK(bench.board->snapshot(0).explanation->confidence == 0.96);
  CHECK(bench.board->snapshot(0).incident.incident().name == "gain_change");
  // The newest stands: the alarm has its own name again.
  e.effect = "stiction";
  e.block = effects::Block::valve;
  e.final_name.reset();
  bench.board->of(0).explained(e);
  CHECK(lines("explanation") == 2);
  CHECK(lines("incident renamed") == 2);
  CHECK(bench.board->snapshot(0).incident.incident().name == "stiction");
  CHECK(bench.state(AlarmKind::stiction) == AlarmState::unacknowledged);
  CHECK(bench.state(AlarmKind::model_gap) == AlarmState::normal);
}

TEST_CASE("remarks of the twin are in the registry with its alarm, and its news in the journal",
          "[monitor][twin]") {
  Bench bench;
  watch::TwinRemarks remarks{.judging = watch::Judging::here,
                             .load = watch::LoadOutside{.size = 0.6, .since_s = 0.1}};
  bench.board->of(0).set_twin_remarks(remarks, 0.1);
  bench.board->of(0).set_twin_remarks(remarks, 0.1);
  remarks.load.reset();
  bench.board->of(0).set_twin_remarks(remarks, 0.1);
  remarks.judging = watch::Judging::outside;
  bench.board->of(0).set_twin_remarks(remarks, 700.0);
  CHECK(bench.board->snapshot(0).twin->judging == watch::Judging::outside);
  bench.journal.wait_written(bench.journal.post({}), std::chrono::seconds(20));
  std::vector<std::string> told;
  for (const journal::JournalRow& row : bench.journal.newest(200)) {
    if (row.entry.what == "twin") told.push_back(row.entry.new_value);
  }
  CHECK(told ==
        std::vector<std::string>{"not judged here", "load back", "load outside +0.6 L/min"});
}

}  // namespace loopwarden::daemon::supervision::monitor_test
