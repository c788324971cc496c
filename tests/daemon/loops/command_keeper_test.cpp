// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/command_keeper.hpp"

#include <catch2/catch.hpp>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::command_keeper_test {
namespace {

using namespace loopwarden::daemon;
using control::Mode;

struct Bench {
  Bench() {
    LoopRuntime loop;
    loop.config.name = "FIC-101";
    loop.config.pv_unit = "m3/h";
    loop.config.pv = plain_settings().pv_check;
    loop.channels = std::make_unique<rt::LoopChannels>(rt::LoopChannels::Room{});
    loop.commissioning = std::make_unique<Commissioning>(*loop.channels);
    loop.settings = std::make_unique<CurrentSettings>(plain_settings(), *loop.channels);
    auto io = std::make_unique<FakeLoopIo>();
    io->set_pv(50.0);
    loop.cycle = std::make_unique<rt::ControlCycle>(
        0, kPeriod, plain_settings(),
        rt::StartSettings{Mode::automatic, 50.0, control::OutputAction::go_to(40.0)},
        rt::ValvePositionSource::none, effects::EffectChain{}, *io, *loop.channels, events);
    loop.io = std::move(io);
    loops.push_back(std::move(loop));
    keeper.emplace(loops, file, LastCommands{});
    run(2);
    REQUIRE(look(0.0));
  }
  void run(int cycles, bool stop = false) {
    for (int i = 0; i < cycles; ++i) {
      ++period;
      loops[0].cycle->run(
          {.now_ns = static_cast<std::int64_t>(period) * kPeriodNs, .period_index = period}, 0,
          stop);
      record::RecordRow row;
      while (loops[0].channels->records.try_pop(row)) {
      }
    }
  }
  void order(const rt::Command& order) {
    REQUIRE(loops[0].channels->master_commands.commands.try_push(order));
    run(1);
    rt::CommandAnswer answer;
    while (loops[0].channels->master_commands.answers.try_pop(answer)) {
    }
  }
  bool look(double passed_s) {
    now_ns += static_cast<std::int64_t>(passed_s * 1e9);
    return keeper->look(now_ns);
  }
  LastCommand on_disk() { return file.load().loops.at("FIC-101"); }

  TemporaryFolder folder;
  LastCommandsFile file{folder / "last-orders.json"};
  std::vector<LoopRuntime> loops;
  base::SpscRing<rt::Event> events{256};
  std::optional<CommandKeeper> keeper;
  std::int64_t now_ns = 1'000'000'000;
  std::uint64_t period = 0;
};

}  // namespace

TEST_CASE("mode and set point are on the disk at the next look", "[restart]") {
  Bench bench;
  CHECK(bench.on_disk().set_point == 50.0);
  CHECK_FALSE(bench.look(0.05));
  bench.order({.set_point = 62.5});
  CHECK(bench.look(0.05));
  CHECK(bench.on_disk().set_point == 62.5);
  CHECK(bench.on_disk().mode == Mode::automatic);
  bench.order({.mode = Mode::manual});
  CHECK(bench.look(0.05));
  CHECK(bench.on_disk().mode == Mode::manual);
  // In manual the set point follows PV. This is no operator's command.
  bench.run(50);
  CHECK_FALSE(bench.look(5.0));
  CHECK(bench.on_disk().set_point == 62.5);
}

TEST_CASE("a set point that a master moves all the time is written once in 10 s", "[restart]") {
  Bench bench;
  int writes = 0;
  double set_point = 20.0;
  constexpr int kTenths = 6000;  // 10 min at 10 Hz
  for (int i = 0; i < kTenths; ++i) {
    bench.order({.set_point = set_point += 0.01});
    if (bench.look(0.1)) ++writes;
  }
  CHECK(writes >= 60);
  CHECK(writes <= 60 + 9);
  do {
    bench.order({.set_point = set_point += 0.01});
  } while (!bench.look(0.1));
  // A mode, or a command that a person waits for, is written at once.
  bench.order({.mode = Mode::manual});
  CHECK(bench.look(0.05));
  bench.order({.mode = Mode::automatic, .set_point = 33.0});
  CHECK(bench.look(0.05));
  bench.order({.set_point = 34.0});
  CHECK_FALSE(bench.look(0.05));
  CHECK_FALSE(bench.keeper->kept(0));
  CHECK(bench.look(0.05));
  CHECK(bench.keeper->kept(0));
  CHECK(bench.on_disk().set_point == 34.0);
}

TEST_CASE("a commissioning and a fault that ends in manual are remembered", "[restart]") {
  Bench bench;
  bench.loops[0].commissioning->take(std::nullopt, "uid 0", 0, Commissioning::Clock::now());
  bench.order({.set_point = 70.0});
  CHECK(bench.look(0.05));
  CHECK(bench.on_disk().commissioned);
  CHECK(bench.on_disk().set_point == 50.0);  // of before
  bench.loops[0].commissioning->give_back();
  CHECK(bench.look(0.05));
  CHECK_FALSE(bench.on_disk().commissioned);
  CHECK(bench.on_disk().set_point == 70.0);
}

TEST_CASE("the effect of the daemon's end on a loop is no command", "[restart]") {
  Bench bench;
  bench.order({.set_point = 71.0});
  bench.keeper->freeze();
  bench.run(10, true);
  CHECK(bench.look(0.05));
  CHECK(bench.on_disk().set_point == 71.0);
  CHECK(bench.on_disk().mode == Mode::automatic);
  CHECK_FALSE(bench.on_disk().manual_after_fault);
}

TEST_CASE("the commands to a loop that is out of service stay on the disk", "[restart]") {
  Bench bench;
  LoopRuntime unread;
  unread.config.name = "fic-102";  // identified by its file, because the tag could not be read
  unread.config.io = config::OutOfService{.why = "loops.d/fic-102.yaml:1:1: error"};
  bench.loops.push_back(std::move(unread));
  LastCommands begun = bench.file.load();
  begun.loops["FIC-102"] = begun.loops.at("FIC-101");
  bench.keeper.emplace(bench.loops, bench.file, begun);
  bench.order({.set_point = 72.0});
  CHECK(bench.look(0.05));
  CHECK(bench.on_disk().set_point == 72.0);
  CHECK(bench.file.load().loops.at("FIC-102") == begun.loops.at("FIC-102"));
  CHECK_FALSE(bench.file.load().loops.contains("fic-102"));
  CHECK(bench.keeper->kept(1));
}

TEST_CASE("the commands to a removed loop are forgotten", "[restart]") {
  Bench bench;
  LastCommands begun = bench.file.load();
  begun.loops["FIC-999"] = begun.loops.at("FIC-101");
  REQUIRE(bench.file.save(begun.loops).empty());
  bench.keeper.emplace(bench.loops, bench.file, begun);
  CHECK(bench.look(0.05));
  CHECK(bench.file.load().loops.size() == 1);
  CHECK_FALSE(bench.look(0.05));
}

TEST_CASE("a disk that refuses is tried again, and the newest counts", "[restart]") {
  Bench bench;
  bench.keeper.emplace(bench.loops, LastCommandsFile(bench.folder / "none/last-orders.json"),
                       bench.file.load());
  bench.order({.set_point = 72.0});
  CHECK_FALSE(bench.look(0.05));
  CHECK_FALSE(bench.keeper->kept(0));
  std::filesystem::create_directories(bench.folder / "none");
  CHECK_FALSE(bench.look(0.05));
  bench.order({.set_point = 73.0});
  CHECK(bench.look(5.0));
  CHECK(LastCommandsFile(bench.folder / "none/last-orders.json")
            .load()
            .loops.at("FIC-101")
            .set_point == 73.0);
}

}  // namespace loopwarden::tests::command_keeper_test
