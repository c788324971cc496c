// SPDX-License-Identifier: Apache-2.0
// Commands that replace related files: after a kill at any rename a daemon can start with the
// folder.
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/loop_model_reader.hpp"
#include "config/validation/validation.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/workbench/files/watched_disk.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::tests::every_state_test {
namespace {

namespace fs = std::filesystem;

void loopwarden(std::vector<std::string> words) {
  workbench::Program program("loopwarden", "", "");
  workbench::add_simulate(program);
  workbench::add_commission(program);
  workbench::add_train(program);
  workbench::add_gap(program);
  std::vector<char*> arguments;
  words.insert(words.begin(), "loopwarden");
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  if (program.run(static_cast<int>(words.size()), arguments.data()) != 0) {
    throw std::runtime_error("exit code");
  }
}

std::string model_text(const std::string& gain) {
  return "sample_time: 0.1\ncontroller: {kp: 0.4, ki: 0.15, output: [0, 10]}\n"
         "process: {gain: " +
         gain +
         ", time_constant: 1.5, dead_time: 0.6}\n"
         "transmitter: {range: [0, 10], resolution: 0.0025, noise: 0.015}\n"
         "scenario: {duration: 300, set_point: [[0, 3], [20, 5], [60, 6.5], [100, 4], [140, 5.5], "
         "[200, 3.5]]}\n";
}

// A folder whose loop has a twin and specialists, and a record of the loop.
struct Commissioned {
  Commissioned() {
    const fs::path made = LOOPWARDEN_SOURCE_DIR "/examples/specialists/plant1";
    write_file(folder / "model.yaml", model_text("1.0"));
    write_file(folder / "etc/m.yaml", model_text("1.0"));
    write_file(folder / "etc/out/twin.yaml", model_text("1.1"));
    fs::copy(made, folder / "etc/out/specialists", fs::copy_options::recursive);
    write_file(folder / "etc/loops.d/FIC-101.yaml",
               "loop: FIC-101\nsample_time: 0.1\n"
               "process_variable: {unit: L/min, range: [0, 10]}\n"
               "controller: {action: reverse, kp: 0.35, ki: 0.04, "
               "output: {unit: V, range: [0, 10]}}\n"
               "start: {mode: manual, set_point: 5}\n"
               "safe_actions: {stop: hold, bad_pv: hold, output_lost: hold, enable_open: hold}\n"
               "monitor: {twin: ../out/twin.yaml, specialists: ../out/specialists}\n"
               "io: {backend: simulated, model: ../m.yaml}\n");
    loopwarden({"simulate", path("model.yaml"), "--out", path("record.csv")});
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  // Checks each copy of `etc`, in order.
  void check(std::size_t states) const {
    for (std::size_t i = 0; i < states; ++i) {
      const auto read = config::validate_all(folder / "states" / std::to_string(i));
      INFO(i << " " << config::to_text(read.diagnostics));
      CHECK(read);
    }
  }
  fs::path last(std::size_t states) const {
    return folder / "states" / std::to_string(states - 1) / "out";
  }

  TemporaryFolder folder;
};

}  // namespace

TEST_CASE("commission, killed at any rename, leaves a twin and specialists that match",
          "[commission][kill][long]") {
  const Commissioned loop;
  const std::size_t states = keep_every_state(
      [&] {
        loopwarden({"commission", loop.path("record.csv"), "--out", loop.path("etc/out"), "--plant",
                    "P1", "--accept-short", "--windows", "700", "--model",
                    loop.path("model.yaml")});
      },
      loop.folder / "etc", loop.folder / "states");
  REQUIRE(states > 8);
  loop.check(states);
  // The new set is there, the weights of the old one are removed, and commission.json was written
  // last.
  CHECK(read_file(loop.last(states) / "specialists/manifest.yaml").find("twin of record.csv") !=
        std::string::npos);
  CHECK_FALSE(fs::exists(loop.last(states - 1) / "commission.json"));
  CHECK(fs::exists(loop.last(states) / "commission.json"));
  CHECK(config::read_specialists(loop.last(states) / "specialists"));
  CHECK_FALSE(fs::exists(loop.last(states) / "specialists/P1L10.weights"));
}

TEST_CASE("gap renames the file that lists the others last", "[gap][kill][long]") {
  const Commissioned loop;
  write_file(loop.folder / "believed.yaml", model_text("1.35"));
  const std::size_t states = keep_every_state(
      [&] {
        loopwarden({"gap", loop.path("record.csv"), "--model", loop.path("believed.yaml"), "--out",
                    loop.path("out"), "--without", "several"});
      },
      loop.folder / "out", loop.folder / "states");
  REQUIRE(states == 4);
  for (std::size_t i = 0; i < states; ++i) {
    const fs::path state = loop.folder / "states" / std::to_string(i);
    CHECK(fs::exists(state / "gap.json") == (i + 1 == states));
    if (i > 0) CHECK(config::read_model_file(state / "model.corrected.yaml"));
  }
}

}  // namespace loopwarden::tests::every_state_test
