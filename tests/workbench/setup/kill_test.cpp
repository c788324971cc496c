// SPDX-License-Identifier: Apache-2.0
// After setup was killed during its renames, a daemon can start with the folder.
#include <catch2/catch.hpp>

#include <filesystem>

#include "config/validation/validation.hpp"
#include "tests/support/loop_file.hpp"
#include "tests/workbench/files/watched_disk.hpp"
#include "tests/workbench/setup/scripted_setup.hpp"

namespace loopwarden::workbench::setup::kill_test {
namespace {

using tests::ScriptedSetup;

const std::map<std::string, std::string> kAnswers{{"control", "here"},
                                                  {"description", "test"},
                                                  {"pv.unit", "m3/h"},
                                                  {"pv.range", "0 25"},
                                                  {"co.unit", "%"},
                                                  {"co.range", "0 100"},
                                                  {"sample_time", "0.2"},
                                                  {"link.transport", "tcp"},
                                                  {"link.hosts", "127.0.0.9"},
                                                  {"link.host", "127.0.0.9"},
                                                  {"link.port", "5999"},
                                                  {"scan.units", "none"},
                                                  {"pv.register", "1 input 0 f32"},
                                                  {"pv.scale", "none"},
                                                  {"co.register", "1 holding 0 f32"},
                                                  {"co.scale", "none"},
                                                  {"stem.register", "none"},
                                                  {"comm_loss", "none"},
                                                  {"pv.follows", "rises"},
                                                  {"kc", "0.2"},
                                                  {"ti", "10"},
                                                  {"sp.limits", "0 25"},
                                                  {"co.limits", "0 100"},
                                                  {"co.rate", "none"},
                                                  {"stop.end", "hold"},
                                                  {"stop.bad_pv", "hold"},
                                                  {"stop.output_lost", "hold"},
                                                  {"write", "yes"}};

}  // namespace

TEST_CASE("setup, killed at any rename, leaves a valid folder", "[setup][kill]") {
  for (const bool first_loop : {true, false}) {
    std::unique_ptr<ScriptedSetup> s;
    const auto prepare = [&] {
      s = std::make_unique<ScriptedSetup>();
      for (const auto& [id, answer] : kAnswers) s->state.answer(id, answer);
      if (first_loop) return;
      tests::write_file(s->folder / "m.yaml",
                        "sample_time: 0.1\ncontroller: {kp: 0.4, ki: 0.15, output: [0, 10]}\n"
                        "process: {gain: 1.0, time_constant: 1.5, dead_time: 0.6}\n"
                        "transmitter: {range: [0, 10]}\n");
      tests::write_file(s->folder / "loops.d/FIC-100.yaml",
                        "loop: FIC-100\nsample_time: 0.1\n"
                        "process_variable: {unit: L/min, range: [0, 10]}\n"
                        "controller: {action: reverse, kp: 0.35, ki: 0.04, "
                        "output: {unit: V, range: [0, 10]}}\n"
                        "start: {mode: manual, set_point: 5}\n"
                        "safe_actions: {stop: hold, bad_pv: hold, output_lost: hold, "
                        "enable_open: hold}\n"
                        "io: {backend: simulated, model: ../m.yaml}\n");
    };
    const std::size_t renames = tests::kill_at_every_rename(
        prepare, [&] { (void)write_files(s->all); },
        [&](std::size_t given) {
          INFO(given);
          const bool loop_there = std::filesystem::exists(s->folder / "loops.d/FIC-101.yaml");
          const auto read = config::validate_all(s->folder.path());
          INFO(config::to_text(read.diagnostics));
          // Without any loop the daemon does not start.
          CHECK(read.value.has_value() == (loop_there || !first_loop));
        });
    // The state file of setup, which is also rewritten after answers.
    CHECK(renames >= 2);
  }
}

}  // namespace loopwarden::workbench::setup::kill_test
