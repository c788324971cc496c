// SPDX-License-Identifier: Apache-2.0
// Simulates days of plant life in seconds: the loop of the thesis's plant 1, its valve's faults,
// its operator, and the daemon's own monitor, alarms, journal and evidence, with the shipped
// specialists.
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "config/loop_model_reader.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "daemon/evidence/evidence_store.hpp"
#include "daemon/supervision/monitor.hpp"
#include "hal/contract/sample.hpp"
#include "model/watch/specialist_judge.hpp"
#include "model/plant/simulated_loop.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::plant_day_test {
namespace {

using alarm::AlarmAction;
using alarm::AlarmKind;
using alarm::CorrectiveState;
using daemon::rt::Command;
using daemon::rt::JacketMode;
using daemon::supervision::AlarmRegistry;
using daemon::supervision::Monitor;
using record::RecordRow;

constexpr double kHour = 3600.0;
constexpr std::int64_t kStart = 1'800'000'000'000;  // UTC, ms
const std::string kSpecialists = LOOPWARDEN_SOURCE_DIR "/examples/specialists/plant1";

plant::ScheduledFault fault(const char* effect, std::map<std::string, double> parameters,
                            double from_h, double to_h, double ramp_h = 0.0) {
  return {.effect = {.name = effect, .parameters = std::move(parameters)},
          .schedule = {from_h * kHour, to_h * kHour, ramp_h * kHour}};
}

class Plant {
 public:
  explicit Plant(plant::LoopModel model, const alarm::CorrectiveSettings& corrective = {})
      : specialists_(*config::read_specialists(kSpecialists)),
        judge_(*specialists_.team),
        model_(std::move(model)),
        loop_(model_),
        evidence_({.folder = folder_ / "evidence"}, {{kSpecialists, specialists_}},
                  [](const auto&, const auto&, const auto&) {}) {
    journal_.open();
    journal_.start();
    evidence_.start();
    std::vector<daemon::supervision::MonitoredLoop> monitored{
        {.cycles = &cycles_,
         .window = {.sample_time_s = model_.sample_time_s, .pv_high = 10.0, .co_high = 10.0},
         .judge = &judge_,
         .rule = alarm::kAlarmRule,
         .process = {.normal_mode = alarm::NormalMode::automatic, .limits = {}},
         .corrective = corrective,
         .channels = {.commands = &desk_}}};
    monitor_ = std::make_unique<Monitor>(
        std::move(monitored), board_,
        [this](std::size_t, AlarmKind alarm, const watch::LoopMonitor& watched_by,
               const watch::MonitorStep& step,
               alarm::AlarmReason reason) { keep(alarm, watched_by, step, reason); });
  }

  void run_to(double hour) {
    while (static_cast<double>(period_) * model_.sample_time_s < hour * kHour) {
      const plant::LoopSample s = loop_.step();
      jacket_acted = jacket_acted || s.jacket_rate != 0.0;
      RecordRow row;
      row.period_index = period_++;
      row.sp = s.sp;
      row.pv = s.pv;
      row.co = s.co;
      row.stem = s.stem;
      row.mode = loop_.controller().mode();
      row.pv_quality = sensor_good ? hal::Quality::good : hal::Quality::bad;
      if (!cycles_.try_push(row)) FAIL("the monitor is behind");
      if (period_ % 200 == 0) look();
    }
    look();
  }
  bool act(AlarmKind kind, AlarmAction action, double hours = 0.0) {
    return board_
        .act(0, {kind, action, static_cast<std::int64_t>(hours * kHour * 1000.0), "uid 1000", {}})
        .accepted;
  }
  void set_mode(control::Mode mode) { loop_.controller().request_mode(mode); }
  // Returns one name for an alarm that is off and one that can't be raised: the operator sees no
  // difference.
  static std::string quiet(const std::string& state) {
    return state == "suppressed" ? "normal" : state;
  }
  // Returns the journal's lines of this kind, oldest first, without changes below a shelf.
  std::vector<std::string> lines(daemon::journal::JournalEntry::Kind kind) {
    journal_.wait_written(journal_.post({}), std::chrono::seconds(20));
    std::vector<std::string> texts;
    for (const daemon::journal::JournalRow& row : journal_.newest(1000)) {
      const auto& e = row.entry;
      if (e.kind != kind || e.loop.empty() || e.what.starts_with("incident")) continue;
      if (e.kind == daemon::journal::JournalEntry::Kind::alarm && e.from == e.to) continue;
      texts.insert(texts.begin(), kind == daemon::journal::JournalEntry::Kind::alarm
                                      ? e.alarm + ": " + quiet(e.from) + " > " + quiet(e.to)
                                      : e.what + ": " + e.old_value + " > " + e.new_value);
    }
    return texts;
  }
  alarm::AlarmState state(AlarmKind kind) { return board_.snapshot(0).alarms.alarm(kind).state(); }
  double hour_raised(AlarmKind kind) {
    const daemon::supervision::AlarmSnapshot watch = board_.snapshot(0);
    return static_cast<double>(watch.alarms.alarm(kind).memory().raised_ms - kStart) / 3.6e6;
  }
  CorrectiveState corrective() { return board_.snapshot(0).corrective; }
  AlarmRegistry& board() { return board_; }
  daemon::EvidenceStore& evidence() { return evidence_; }

  double hour() const { return static_cast<double>(period_) * model_.sample_time_s / kHour; }

  bool sensor_good = true;
  bool jacket_acted = false;

 private:
  void look() {
    do {
      monitor_->round();
    } while (monitor_->status().backlog > 0);
    Command order;
    while (orders_.commands.try_pop(order)) {
      control::ControllerSettings settings = model_.controller;
      settings.jacket.shadow = order.jacket != JacketMode::on;
      loop_.controller().configure(settings);
      orders_.answers.try_push({order.number, daemon::rt::Refusal::none});
    }
    monitor_->round();  // hears the answers
  }
  void keep(AlarmKind alarm, const watch::LoopMonitor& watched_by, const watch::MonitorStep& step,
            alarm::AlarmReason reason) {
    evidence::Evidence e;
    e.loop = "FIC-101";
    e.alarm = alarm;
    e.raised_ms = board_.snapshot(0).alarms.alarm(alarm).memory().raised_ms;
    e.take(watched_by, step, reason);
    e.specialists_folder = kSpecialists;
    evidence_.post(std::move(e));
  }

  TemporaryFolder folder_;
  config::SpecialistFolder specialists_;
  watch::SpecialistJudge judge_;
  plant::LoopModel model_;
  plant::SimulatedLoop loop_;
  std::uint64_t period_ = 0;
  base::SpscRing<RecordRow> cycles_{1024};
  daemon::rt::CommandMailbox orders_;
  std::atomic<std::uint8_t> standing_{0};
  daemon::journal::Journal journal_{{.folder = folder_.path()}};
  daemon::EvidenceStore evidence_;
  AlarmRegistry board_{{{"FIC-101", 0.1}}, {}, journal_, [this] {
                         return kStart + static_cast<std::int64_t>(100 * period_);
                       }};
  daemon::commands::CommandQueue desk_{
      orders_,
      standing_,
      {.write_down = [this](daemon::journal::JournalEntry line) { return journal_.post(line); },
       .why = [](const daemon::rt::CommandAnswer& answer,
                 const Command&) { return to_text(answer.refusal); }}};
  std::unique_ptr<Monitor> monitor_;
};

// A wandering load, and an operator who moves the set point every ten minutes.
plant::LoopModel day_model(double hours, bool steps = true) {
  plant::LoopModel m = *config::read_model_file(kSpecialists + "/model.yaml");
  m.transmitter.noise = 0.01;
  m.disturbances.push_back({.name = "random_load", .parameters = {{"intensity", 0.003}}});
  m.scenario = {.duration_s = hours * kHour, .set_point = {{0.0, 5.0}}, .faults = {}, .seed = 4711};
  constexpr std::array kSetPoints{5.0, 6.2, 4.4, 5.6, 3.9};
  for (std::size_t k = 1; steps && 600.0 * static_cast<double>(k) < hours * kHour; ++k) {
    m.scenario.set_point.emplace_back(600.0 * static_cast<double>(k), kSetPoints[k % 5]);
  }
  return m;
}

ShellOutcome replay(const std::filesystem::path& evidence) {
  return run(LOOPWARDEN_CLI " replay " + evidence.string() + " 2>&1");
}

}  // namespace

TEST_CASE("a day: faults that begin and end, an operator, a sensor that fails, maintenance",
          "[closed_loop][plant_day]") {
  plant::LoopModel model = day_model(24.0);
  // These sizes give alarms with single names. `loopwarden-study alarm` measures how often others
  // don't: on this same day stiction of 20 % of span also raises hysteresis.
  model.scenario.faults = {
      fault("stiction", {{"s", 1.2}, {"j", 0.6}}, 4.0, 10.0, 2.0),
      fault("backlash", {{"deadband", 2.0}}, 13.5, 17.0),
      fault("low_air_supply", {{"rate", 0.1}, {"travel_limit", 7.0}}, 21.0, 22.5)};
  Plant plant(std::move(model));
  using Lines = std::vector<std::string>;
  const auto alarms = [&] { return plant.lines(daemon::journal::JournalEntry::Kind::alarm); };

  plant.run_to(4.0);
  CHECK(alarms() == Lines{});  // healthy

  plant.run_to(8.0);  // the packing tightens
  CHECK(plant.state(AlarmKind::stiction) == alarm::AlarmState::unacknowledged);
  CHECK(plant.hour_raised(AlarmKind::stiction) < 6.5);
  CHECK(plant.act(AlarmKind::stiction, AlarmAction::acknowledge));
  plant.run_to(12.0);  // repaired at 10
  plant.set_mode(control::Mode::manual);
  plant.run_to(12.5);
  CHECK(plant.act(AlarmKind::not_normal_mode, AlarmAction::acknowledge));
  plant.set_mode(control::Mode::automatic);
  plant.run_to(13.0);
  plant.sensor_good = false;
  plant.run_to(13.2);
  CHECK(plant.state(AlarmKind::stiction) == alarm::AlarmState::suppressed);
  CHECK(plant.act(AlarmKind::bad_pv, AlarmAction::acknowledge));
  plant.sensor_good = true;

  plant.run_to(16.0);  // play in the linkage since 13.5 h
  CHECK(plant.state(AlarmKind::backlash) == alarm::AlarmState::unacknowledged);
  CHECK(plant.act(AlarmKind::backlash, AlarmAction::shelve, 4.0));
  plant.set_mode(control::Mode::manual);
  plant.run_to(17.0);  // repaired
  CHECK(plant.act(AlarmKind::not_normal_mode, AlarmAction::acknowledge));
  plant.set_mode(control::Mode::automatic);
  plant.run_to(20.5);

  plant.run_to(22.5);  // too little air since 21 h, without its consequences
  CHECK(plant.state(AlarmKind::low_air_supply) == alarm::AlarmState::unacknowledged);
  plant.run_to(23.7);  // the supply is back since 22.5 h
  CHECK(plant.act(AlarmKind::low_air_supply, AlarmAction::acknowledge));
  plant.run_to(24.0);

  CHECK(alarms() ==
        Lines{"stiction: normal > unacknowledged", "stiction: unacknowledged > acknowledged",
              "stiction: acknowledged > normal", "not_normal_mode: normal > unacknowledged",
              "not_normal_mode: unacknowledged > acknowledged",
              "not_normal_mode: acknowledged > normal", "bad_pv: normal > unacknowledged",
              "bad_pv: unacknowledged > acknowledged", "bad_pv: acknowledged > normal",
              "backlash: normal > unacknowledged", "backlash: unacknowledged > shelved",
              "not_normal_mode: normal > unacknowledged",
              "not_normal_mode: unacknowledged > acknowledged",
              "not_normal_mode: acknowledged > normal", "backlash: shelved > normal",
              "low_air_supply: normal > unacknowledged",
              "low_air_supply: unacknowledged > returned_unacknowledged",
              "low_air_supply: returned_unacknowledged > normal"});

  // The program judges each alarm's evidence again and gets the same result.
  REQUIRE(test::eventually([&] { return plant.evidence().status().written == 3; }));
  for (const AlarmKind kind :
       {AlarmKind::stiction, AlarmKind::backlash, AlarmKind::low_air_supply}) {
    const auto folder = plant.evidence().newest("FIC-101", kind);
    REQUIRE(folder);
    const ShellOutcome replayed = replay(*folder);
    INFO(replayed.text);
    CHECK(replayed.exit_code == 0);
    CHECK(replayed.text.find("The same verdict.") != std::string::npos);
    CHECK(replayed.text.find(to_text(kind)) != std::string::npos);
  }
  // It reports evidence that was changed.
  const auto folder = *plant.evidence().newest("FIC-101", AlarmKind::stiction);
  std::string record = read_file(folder / "record.csv");
  record[record.size() / 2] = record[record.size() / 2] == '1' ? '2' : '1';
  write_file(folder / "record.csv", record);
  const ShellOutcome changed = replay(folder);
  CHECK(changed.exit_code == 65);
  CHECK(changed.text.find("record.csv has been changed") != std::string::npos);
}

TEST_CASE("corrective action: the jacket acts, and is withdrawn at a veto or with the mode",
          "[closed_loop][plant_day]") {
  plant::LoopModel model = day_model(4.0, false);
  model.disturbances.clear();
  model.controller.jacket = {.form = control::JacketForm::dwell, .shadow = true, .dead_zone = 0.03};
  model.scenario.faults = {fault("stiction", {{"s", 1.5}, {"j", 1.2}}, 0.5, 9.0)};
  Plant plant(std::move(model), {.enabled = true});
  const auto steps = [&] { return plant.lines(daemon::journal::JournalEntry::Kind::system); };
  plant.run_to(0.5);
  CHECK(plant.corrective() == CorrectiveState::waiting);
  for (double h = 0.6; h < 2.0 && plant.corrective() == CorrectiveState::waiting; h += 0.1) {
    CHECK_FALSE(plant.jacket_acted);
    plant.run_to(h);
  }
  REQUIRE(plant.corrective() == CorrectiveState::trying);
  CHECK(steps() == std::vector<std::string>{"jacket on: waiting > trying"});
  const double hour = plant.hour();
  plant.run_to(hour + 0.2);
  CHECK(plant.jacket_acted);

  SECTION("the operator's veto") {
    REQUIRE(plant.board().of(0).set_veto(alarm::Veto::back, "uid 1000", "no").accepted);
    plant.run_to(hour + 0.25);
    CHECK(plant.corrective() == CorrectiveState::vetoed);
    CHECK(steps().back() == "jacket back to shadow: trying > vetoed");
    plant.jacket_acted = false;
    plant.run_to(hour + 1.5);
    CHECK_FALSE(plant.jacket_acted);
  }
  SECTION("manual: once more from a new baseline") {
    plant.set_mode(control::Mode::manual);
    plant.run_to(hour + 0.25);
    CHECK(plant.corrective() == CorrectiveState::waiting);
    CHECK(steps().back() == "jacket back to shadow: trying > waiting");
  }
}

TEST_CASE("corrective action that does not help is withdrawn, and not tried again",
          "[closed_loop][plant_day]") {
  plant::LoopModel model = day_model(4.0, false);
  model.disturbances.clear();
  // A gain of zero: a jacket without effect.
  model.controller.jacket = {
      .form = control::JacketForm::bounded, .shadow = true, .gain_per_s = 0.0, .dead_zone = 0.03};
  model.scenario.faults = {fault("stiction", {{"s", 1.5}, {"j", 1.2}}, 0.5, 9.0)};
  Plant plant(std::move(model), {.enabled = true});
  plant.run_to(4.0);
  CHECK(plant.corrective() == CorrectiveState::given_up);
  const auto steps = plant.lines(daemon::journal::JournalEntry::Kind::system);
  CHECK(steps == std::vector<std::string>{"jacket on: waiting > trying",
                                          "jacket back to shadow: trying > given up"});
}

}  // namespace loopwarden::tests::plant_day_test
