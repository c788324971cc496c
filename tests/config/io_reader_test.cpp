// SPDX-License-Identifier: Apache-2.0
#include "config/io_reader.hpp"

#include "tests/config/config_support.hpp"

namespace io_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kLoopHead;
using test::ScratchFolder;
using test::with;

namespace {

// Returns the messages for a loop file loops.d/a.yaml with this io section, and a model and record
// in the same folder.
struct Trial {
  ScratchFolder folder;

  Trial() {
    folder.write("m.yaml", test::kModel);
    folder.write("r.csv", "time,pv\n0,1\n0.1,1\n");
  }
  Loaded<LoopConfig> read(const std::string& io) const {
    const std::string file = (folder.path() / "loops.d" / "a.yaml").string();
    return read_loop_text(file, kLoopHead + io, test::daemon());
  }
  std::string said(const std::string& io) const { return folder.relative(test::said(read(io))); }
};

}  // namespace

TEST_CASE("The backend is named, and only its keys count", "[config][io]") {
  const Trial trial;
  CHECK(trial.said("io: {model: ../m.yaml}\n") ==
        "loops.d/a.yaml:16:5: error: missing key 'backend' in 'io' (simulated, modbus, analog or "
        "replay)\n");
  CHECK(trial.said("io: {backend: simulate, model: ../m.yaml}\n") ==
        "loops.d/a.yaml:16:15: error: io.backend: must be simulated, modbus, analog or replay (got "
        "'simulate'); did you mean 'simulated'?\n");
  CHECK(trial.said("io: {backend: simulated, model: ../m.yaml, record: ../r.csv}\n") ==
        "loops.d/a.yaml:16:44: error: unknown key 'record'\n");
}

TEST_CASE("A simulated loop takes its plant from a model that fits it", "[config][io]") {
  const Trial trial;
  const auto loop = trial.read(
      "io: {backend: simulated, model: ../m.yaml, output_resolution: 0.01,\n"
      "     io_faults: [{fault: dead_sensor, from: 5, to: 9}]}\n");
  INFO(to_text(loop.diagnostics));
  REQUIRE(loop);
  const auto& sim = std::get<SimIo>(loop->io);
  CHECK(sim.model.process.gain == 1.2264);
  CHECK(sim.output_resolution == 0.01);
  CHECK(loop->controller.pid.tolerance == 0.01);
  REQUIRE(sim.io_faults.size() == 1);
  CHECK(sim.io_faults.front() == hal::sim::IoFault{hal::sim::IoFault::Kind::dead_sensor, 5, 9});

  CHECK(trial.said("io: {backend: simulated, model: absent.yaml}\n") ==
        "loops.d/a.yaml:16:33: error: io.model: loops.d/absent.yaml: error: can't be read: No such "
        "file or directory\n");
  trial.folder.write("slow.yaml", with(test::kModel, "sample_time: 0.1", "sample_time: 1"));
  CHECK(trial.said("io: {backend: simulated, model: ../slow.yaml}\n") ==
        "loops.d/a.yaml:16:33: error: io.model: slow.yaml: its sample_time is 1 s, this loop's is "
        "0.1 "
        "s (at 2:14)\n");
  trial.folder.write("wide.yaml", with(test::kModel, "output: [0, 10]", "output: [0, 100]"));
  CHECK(trial.said("io: {backend: simulated, model: ../wide.yaml}\n") ==
        "loops.d/a.yaml:16:33: error: io.model: wide.yaml: its controller.output is [0, 100], this "
        "loop's output range is another (at 9:28)\n");
  trial.folder.write("far.yaml", with(test::kModel, "  range: [0, 10]", "  range: [0, 20]"));
  CHECK(trial.said("io: {backend: simulated, model: ../far.yaml}\n") ==
        "loops.d/a.yaml:16:33: error: io.model: far.yaml: its transmitter.range is [0, 20], this "
        "loop's range is another (at 3:40)\n");
  trial.folder.write("bad.yaml", with(test::kModel, "gain: 1.2264", "gain: x"));
  CHECK(
      trial.said("io: {backend: simulated, model: ../bad.yaml}\n") ==
      "loops.d/a.yaml:16:33: error: io.model: bad.yaml:7:9: error: process.gain: must be a number "
      "(got 'x')\n");
  CHECK(
      trial.said("io: {backend: simulated, model: ../m.yaml, io_faults: [{fault: frozen, from: 5, "
                 "to: 5}]}\n") ==
      "loops.d/a.yaml:16:85: error: io.io_faults[0].to: must be after from = 5 s (at 16:78) (got "
      "5)\n");
}

TEST_CASE("A replayed loop takes its record from a file", "[config][io]") {
  const Trial trial;
  const auto loop = trial.read("io: {backend: replay, record: ../r.csv, repeat: true}\n");
  INFO(to_text(loop.diagnostics));
  REQUIRE(loop);
  const auto& replay = std::get<hal::replay::ReplaySettings>(loop->io);
  CHECK(replay.record == (trial.folder.path() / "r.csv").string());
  CHECK(replay.repeat);
  CHECK(replay.sample_time_s == 0.1);
  CHECK(replay.output_high == 10.0);
  CHECK(trial.said("io: {backend: replay, record: gone.csv}\n") ==
        "loops.d/a.yaml:16:31: error: io.record: loops.d/gone.csv is no readable file\n");
}

}  // namespace io_reader_test
