// SPDX-License-Identifier: Apache-2.0
// A loop with a sticking valve and its plant, for tests of TestSessions. A fake clock: the test
// runs the cycles, the side of the operators, and the keeper of the last commands.
#pragma once

#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "daemon/console/operator_commands.hpp"
#include "daemon/console/request.hpp"
#include "daemon/loops/command_keeper.hpp"
#include "daemon/loops/warm_start.hpp"
#include "model/plant/plant.hpp"
#include "tests/daemon/console/console_bench.hpp"

namespace loopwarden::daemon::console_bench {

// Of the loop of console.hpp: CO and PV 0 to 100.
inline plant::LoopModel tested_plant() {
  plant::LoopModel model;
  model.sample_time_s = tests::kPeriod;
  model.controller.pid.output_high = 100.0;
  model.process.gain = 1.0;
  model.process.time_constant_s = 2.0;
  model.process.dead_time_s = 0.5;
  model.transmitter.high = 100.0;
  model.valve_effects = {{"stiction", {{"s", 2.0}, {"j", 0.5}}}};
  return model;
}

struct TestedLoop : Console {
  explicit TestedLoop(control::Recovery recovery = control::Recovery::previous_mode,
                      bool set_point_tracks = false)
      : Console({}, control::OutputAction::go_to(50.0)), plant_(tested_plant(), 1) {
    rt::LoopSettings changed = loops[0].settings->get();
    changed.controller.jacket.form = control::JacketForm::off;
    changed.controller.pid.gains = {.kp = 0.4, .ki = 0.2};
    changed.controller.set_point_tracks_in_manual = set_point_tracks;
    changed.safety.recovery = recovery;
    loops[0].config.sample_time_s = tests::kPeriod;
    loops[0].config.controller = changed.controller;
    loops[0].config.safety = changed.safety;
    loops[0].config.pv = changed.pv_check;
    loops[0].config.start.after_restart = config::Start::AfterRestart::resume;
    loops[0].config.start.output_is_told = true;
    offer(changed);
    plant_.reset(50.0);
    restart_keeper({});
    run_for(6.0);
    REQUIRE(row().fault == control::Fault::none);
  }

  tests::FakeLoopIo& io() { return dynamic_cast<tests::FakeLoopIo&>(*loops[0].io); }
  void offer(const rt::LoopSettings& settings) {
    loops[0].channels->settings.publish({.settings = settings, .number = ++offers_});
  }
  bool offer_taken() const { return loops[0].channels->settings_taken == offers_; }

  // Runs the loop on its plant. The sides of operators and keeper follow every second.
  void run_for(double seconds) {
    const long cycles = std::lround(seconds / tests::kPeriod);
    for (long i = 0; i < cycles; ++i) {
      if (!device_lost) plant_.step(io().written < 0.0 ? 50.0 : io().written);
      if (!pv_forced) io().set_pv(plant_.process_variable() + pv_offset);
      if (read_back) io().set_read_back(plant_.stem());
      io().inputs.output_ok = !device_lost;
      Console::run(1);
      if (workbench_alive && session) {
        if (const json now = request({{"session", *session}}); now.at("ok") == false) {
          told = now.at("error").get<std::string>();
          session.reset();
        }
      }
      if (i % 10 == 9) tick();
    }
    if (cycles % 10 != 0) tick();
  }
  void tick() {
    REQUIRE(test::eventually([&] { return row().period_index == cycles_run; }));
    operators->collect(clock());
    keeper->look(static_cast<std::int64_t>(cycles_run) * tests::kPeriodNs);
  }
  // The time of the loop.
  Commissioning::Clock::time_point clock() const {
    return Commissioning::Clock::time_point(
        std::chrono::nanoseconds(static_cast<std::int64_t>(cycles_run) * tests::kPeriodNs));
  }
  // The daemon ends without a word. Another one starts with the commands on the disk.
  void kill_daemon() {
    LastCommands kept = LastCommandsFile(folder / "orders").load();
    const WarmStart warm = warm_start(loops[0].config, kept);
    loops[0].commissioning->give_back();
    const double output = io().written;
    rt::StartSettings start = warm.start;
    start.output = control::OutputAction::go_to(output);
    rt::LoopSettings settings =
        settings_of(loops[0].config, config::backing_of(loops[0].config.io));
    rt::Command left;
    while (loops[0].channels->operator_commands.commands.try_pop(left)) {
    }
    rt::CommandAnswer answer;
    while (loops[0].channels->operator_commands.answers.try_pop(answer)) {
    }
    operators = new_operators();
    cycle = std::make_unique<rt::ControlCycle>(
        0, tests::kPeriod, settings, start, rt::ValvePositionSource::none, effects::EffectChain{},
        *loops[0].io, *loops[0].channels, events);
    session.reset();
    restart_keeper(std::move(kept));
  }

  json request(json more, const console::Sender& sender = {.peer = "uid 1000"}) {
    more["loop"] = "FIC-101";
    if (!more.contains("request")) more["request"] = "commissioning";
    const auto answer = console::answer_line(more.dump(), [&](const json& asked) {
      return std::get<std::string>(operators->answer(protocol::name_of(asked), asked, sender));
    });
    return json::parse(answer);
  }
  json terms(double size, bool manual) {
    const double from = manual ? row().co : 50.0;
    return {{"pv", {40.0, 60.0}},
            {"co", {20.0, 80.0}},
            {"moved", {from - std::abs(size), from + std::abs(size)}},
            {"manual", manual},
            {"longest_s", 120.0},
            {"plan", "stiction or backlash"}};
  }
  json begin(double size, bool manual) {
    const json answer = request({{"test", terms(size, manual)}});
    if (answer.at("ok") == true) {
      session = answer.at("session").get<std::uint64_t>();
      workbench_alive = true;
    }
    return answer;
  }
  json move(double to) { return request({{"session", session.value_or(0)}, {"move", to}}); }
  json end() {
    const json answer = request({{"session", session.value_or(0)}, {"end", true}});
    session.reset();
    return answer;
  }

  record::RecordRow row() {
    record::RecordRow newest;
    historian.latest(0, newest);
    return newest;
  }
  control::Mode mode() { return rt::unpacked(loops[0].channels->availability.load()).mode; }
  double set_point() const { return loops[0].channels->set_point_wanted.load(); }
  bool released() const { return !loops[0].commissioning->holder().has_value(); }

  void alarm(alarm::AlarmKind kind, bool on) {
    const supervision::ProcessNews news{{kind, on, cycles_run}, {}};
    board.of(0).process_changed({&news, 1});
  }

  bool device_lost = false;
  bool read_back = true;
  bool pv_forced = false;
  double pv_offset = 0.0;
  bool workbench_alive = true;
  std::optional<std::uint64_t> session;
  std::string told;  // why the test has ended

  std::unique_ptr<console::OperatorCommands> operators = new_operators();
  std::unique_ptr<CommandKeeper> keeper;

 private:
  std::unique_ptr<console::OperatorCommands> new_operators() {
    return std::make_unique<console::OperatorCommands>(Console::plant(), archive(), daemon, daemon,
                                                       [this] { return clock(); });
  }
  void restart_keeper(LastCommands begun) {
    keeper = std::make_unique<CommandKeeper>(loops, LastCommandsFile(folder / "orders"),
                                             std::move(begun));
  }

  plant::Plant plant_;
  std::uint32_t offers_ = 0;
};

}  // namespace loopwarden::daemon::console_bench
