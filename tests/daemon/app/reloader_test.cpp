// SPDX-License-Identifier: Apache-2.0
// Tests reloads of changing files. The test itself runs the cycles of the loop.
#include "daemon/app/reloader.hpp"

#include <catch2/catch.hpp>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/digest/digest.hpp"
#include "config/config_reader.hpp"
#include "tests/config/config_support.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::reloader_test {
namespace {

using namespace loopwarden::daemon;
using config::test::with;
using nlohmann::json;

const std::string kLoop = config::test::kLoopHead + "io: {backend: simulated, model: ../m.yaml}\n";

struct Bench {
  Bench()
      : historian(loops, {.state_directory = state.path(), .sync = std::chrono::milliseconds(0)}) {
    write("loopwardend.yaml", "log_level: info\n");
    write("loops.d/a.yaml", kLoop);
    files.write("m.yaml", config::test::kModel);
    auto read = config::read_configuration(files.path());
    INFO(config::to_text(read.diagnostics));
    REQUIRE(read);
    started = std::move(*read);
    LoopRuntime loop;
    loop.config = started.loops.at(0);
    auto io = std::make_unique<FakeLoopIo>();
    io->set_pv(5.0);
    io->set_read_back(5.0);
    loop.channels = std::make_unique<rt::LoopChannels>(rt::LoopChannels::Room{});
    loop.commissioning = std::make_unique<Commissioning>(*loop.channels);
    const rt::LoopSettings settings = settings_of(loop.config, config::backing_of(loop.config.io));
    loop.settings = std::make_unique<CurrentSettings>(settings, *loop.channels);
    loop.cycle = std::make_unique<rt::ControlCycle>(
        0, kPeriod, settings, rt::StartSettings{control::Mode::manual, 5.0, {}},
        rt::ValvePositionSource::none, effects::EffectChain{}, *io, *loop.channels, events);
    loop.io = std::move(io);
    loops.push_back(std::move(loop));
    journal.open();
    journal.start();
    historian.start();
    reloader = std::make_unique<Reloader>(
        started, files.path(), loops, historian, journal,
        ReloaderCallbacks{
            .take_over = [this](const config::DaemonConfig& d) { log_level = d.log_level; },
            .reloading = [this] { ++reloading; },
            .ready = [this] { ++ready; }});
    reloader->start();
    run(5);
    REQUIRE(test::eventually([&] {
      record::RecordRow row;
      return historian.latest(0, row) && row.co == 5.0;
    }));
  }
  ~Bench() {
    reloader->stop();
    historian.stop();
    journal.stop();
  }

  void write(const std::string& name, const std::string& text) { files.write(name, text); }
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      ++period;
      loops[0].cycle->run(
          {.now_ns = static_cast<std::int64_t>(period) * kPeriodNs, .period_index = period}, 0,
          false);
    }
  }
  // Acts as main thread and loop until the request is done.
  json done(std::uint64_t number) {
    json told;
    REQUIRE(test::eventually([&] {
      reloader->step();
      run(1);
      told = *reloader->state(number);
      return told.at("state") == "done";
    }));
    return told;
  }
  json reload(bool take_file = false) { return done(reloader->post("uid 1000", false, take_file)); }
  std::size_t waiting(const char* list) const { return json(reloader->status()).at(list).size(); }
  double kp() const { return loops[0].settings->get().controller.pid.gains.kp; }

  config::test::ScratchFolder files;
  TemporaryFolder state;
  config::Configuration started;
  std::vector<LoopRuntime> loops;
  Historian historian;
  journal::Journal journal{{.folder = state.path()}};
  base::SpscRing<rt::Event> events{256};
  std::string log_level;
  int reloading = 0;
  int ready = 0;
  std::uint64_t period = 0;
  std::unique_ptr<Reloader> reloader;
};

}  // namespace

TEST_CASE("a reload is reported step by step, and its hash is that of the files", "[app][reload]") {
  Bench bench;
  const std::uint32_t first = bench.reloader->config_hash();
  bench.write("loops.d/a.yaml", with(kLoop, "kp: 0.35", "kp: 0.5"));
  bench.write("loopwardend.yaml", "log_level: debug\n");
  const std::uint64_t number = bench.reloader->post("uid 1000", false, false);
  CHECK(json(*bench.reloader->state(number)) == json{{"state", "waiting"}});
  const json result = bench.done(number);
  CHECK(result.at("outcome") == "in_force");
  CHECK(bench.kp() == 0.5);
  CHECK(bench.log_level == "debug");
  CHECK(bench.reloading == 1);
  CHECK(bench.ready == 1);
  CHECK(bench.reloader->config_hash() != first);
  CHECK(bench.reloader->config_hash() == bench.reloader->status().files_hash);
  CHECK_FALSE(bench.reloader->state(99));
}

TEST_CASE("a dry run reports the same and changes no loop", "[app][reload]") {
  Bench bench;
  const std::uint32_t first = bench.reloader->config_hash();
  bench.write("loops.d/a.yaml", with(kLoop, "kp: 0.35", "kp: 0.5"));
  bench.write("loopwardend.yaml", "log_level: debug\n");
  const json dry = bench.done(bench.reloader->post("uid 1000", true, false));
  CHECK(bench.kp() == 0.35);
  CHECK(bench.log_level.empty());
  CHECK(bench.reloading == 0);
  CHECK(bench.reloader->config_hash() == first);
  CHECK(bench.reload().at("lines") == dry.at("lines"));
  CHECK(bench.kp() == 0.5);
}

TEST_CASE("while a key waits, the hash is that of the configuration in force", "[app][reload]") {
  Bench bench;
  const std::uint32_t first = bench.reloader->config_hash();
  const std::string described = with(kLoop, "loop: FIC-101", "loop: FIC-101\ndescription: feed");
  bench.write("loops.d/a.yaml", described);
  CHECK(bench.reload().at("outcome") == "waits");
  const std::uint32_t mixed = bench.reloader->config_hash();
  CHECK(mixed != first);
  CHECK(mixed != bench.reloader->status().files_hash);
  CHECK(bench.reload().at("outcome") == "waits");
  CHECK(bench.reloader->config_hash() == mixed);
  CHECK(bench.waiting("waiting_for_restart") == 1);
  // Errors change neither the waiting settings nor those in force.
  bench.write("loops.d/a.yaml", "loop: [\n");
  CHECK(bench.reload().at("outcome") == "refused");
  CHECK(bench.reloader->config_hash() == mixed);
  CHECK(bench.waiting("waiting_for_restart") == 1);
  CHECK(bench.reloader->status().refused != "");
  // After a return to the old files no key waits.
  bench.write("loops.d/a.yaml", kLoop);
  CHECK(bench.reload().at("outcome") == "in_force");
  CHECK(bench.reloader->config_hash() == first);
  CHECK(bench.reloader->status().files_in_force);
}

TEST_CASE("no reload while a loop is being commissioned", "[app][reload]") {
  Bench bench;
  bench.loops[0].commissioning->take(std::nullopt, "uid 0", 0, Commissioning::Clock::now());
  bench.write("loops.d/a.yaml", with(kLoop, "kp: 0.35", "kp: 0.5"));
  const bool dry_run = GENERATE(true, false);
  const json refused = bench.done(bench.reloader->post("uid 1000", dry_run, false));
  CHECK(refused.at("outcome") == "refused");
  CHECK(refused.at("not_now") == true);
  CHECK_THAT(refused.at("why").get<std::string>(),
             Catch::Contains("FIC-101 is in maintenance by uid 0"));
  CHECK(bench.kp() == 0.35);
  // A dry run also shows whether the file is in force.
  if (dry_run) {
    const json& loop = refused.at("plan").at("loops").at(0);
    CHECK(loop.at("applied").at(0).at("key") == "controller.kp");
    CHECK(loop.at("file_hash") == base::crc32(with(kLoop, "kp: 0.35", "kp: 0.5")));
  }
  bench.loops[0].commissioning->give_back();
  CHECK(bench.reload().at("outcome") == "in_force");
  CHECK(bench.kp() == 0.5);
}

TEST_CASE("a reload that arrives during a commissioning is carried out after its end",
          "[app][reload]") {
  Bench bench;
  bench.loops[0].commissioning->take(std::nullopt, "uid 0", 0, Commissioning::Clock::now());
  bench.write("loops.d/a.yaml", with(kLoop, "kp: 0.35", "kp: 0.5"));
  bench.reload();
  bench.done(bench.reloader->post("uid 1000", true, false));  // a dry run is not kept
  CHECK_THAT(bench.reloader->status().refused, Catch::Contains("are taken when that has ended"));
  CHECK_FALSE(bench.reloader->status().files_in_force);
  const auto steps = [&](int count) {
    for (int i = 0; i < count; ++i) {
      bench.reloader->step();
      bench.run(1);
    }
  };
  steps(20);
  CHECK(bench.kp() == 0.35);
  const bool sound = GENERATE(true, false);
  // The files at the end of the commissioning count.
  bench.write("loops.d/a.yaml", sound ? with(kLoop, "kp: 0.35", "kp: 0.7") : "loop: [\n");
  bench.loops[0].commissioning->give_back();
  REQUIRE(test::eventually([&] {
    steps(1);
    return bench.reloading == 2 && bench.ready == 2;
  }));
  if (sound) {
    CHECK(bench.kp() == 0.7);
    CHECK(bench.reloader->status().refused.empty());
    CHECK(bench.reloader->status().files_in_force);
  } else {
    CHECK(bench.kp() == 0.35);
    CHECK_THAT(bench.reloader->status().refused, !Catch::Contains("commissioned"));
  }
  // Carried out once.
  steps(50);
  CHECK(bench.reloading == 2);
}

TEST_CASE("settings that wait for the output are not applied during a commissioning",
          "[app][reload]") {
  Bench bench;
  bench.write("loops.d/a.yaml",
              with(with(kLoop, "limits: [1, 9]", "limits: [1, 4]"), "kp: 0.35", "kp: 0.5"));
  CHECK(bench.reload().at("outcome") == "waits");
  bench.loops[0].commissioning->take(std::nullopt, "uid 0", 0, Commissioning::Clock::now());
  const auto move_output = [&](double to) {
    bench.loops[0].channels->operator_commands.commands.try_push({.number = 1, .output = to});
    bench.run(20);
    bench.reloader->step();
  };
  move_output(3.0);
  CHECK(bench.kp() == 0.35);
  const auto waiting = [&] { return json(bench.reloader->status()).at("waiting_for_output"); };
  REQUIRE(waiting().size() == 2);
  CHECK(waiting()[0].at("why") == "until its commissioning by uid 0 has ended");
  move_output(8.0);  // back at its old value
  bench.loops[0].commissioning->give_back();
  bench.run(5);
  bench.reloader->step();
  CHECK(bench.kp() == 0.35);
  CHECK_THAT(waiting()[0].at("why").get<std::string>(), Catch::Contains("new limits [1, 4]"));
  move_output(3.0);
  CHECK(bench.kp() == 0.5);
  CHECK(waiting().empty());
  CHECK(bench.reloader->status().files_in_force);
}

TEST_CASE("an offer that the loop took during its withdrawal does not stay in force unseen",
          "[app][reload]") {
  Bench bench;
  const rt::LoopSettings before = bench.loops[0].settings->get();
  bench.write("loops.d/a.yaml",
              with(with(kLoop, "limits: [1, 9]", "limits: [1, 4]"), "kp: 0.35", "kp: 0.5"));
  CHECK(bench.reload().at("outcome") == "waits");
  // Back to the old files: no change is left to apply, and the offer is withdrawn.
  bench.write("loops.d/a.yaml", kLoop);
  const std::uint64_t number = bench.reloader->post("uid 1000", false, false);
  REQUIRE(test::eventually([&] {
    bench.reloader->step();
    const json state = *bench.reloader->state(number);
    return state.at("state") == "taking" || state.at("state") == "done";
  }));
  // The cycle took it between the comparison and the withdrawal.
  rt::LoopChannels& channels = *bench.loops[0].channels;
  rt::LoopSettings taken = before;
  taken.controller.pid.gains.kp = 0.5;
  channels.in_force.publish(taken);
  channels.settings_taken = 1;
  bench.reloader->step();
  REQUIRE(bench.kp() == 0.5);
  CHECK_FALSE(bench.reloader->status().files_in_force);
  bench.run(3);
  bench.reloader->step();
  CHECK(bench.kp() == 0.35);
  CHECK(bench.reloader->status().files_in_force);
  CHECK(bench.waiting("waiting_for_output") == 0);
}

TEST_CASE(
    "a reload keeps gains that a person has set and no file has, unless the request overrides them",
    "[app][reload]") {
  Bench bench;
  const auto tune = [&](double kp, bool person) {
    bench.loops[0].channels->operator_commands.commands.try_push({.number = 1, .kp = kp});
    bench.run(1);
    bench.loops[0].settings->gains_ordered(
        {.by = "ella by page", .utc_ms = 1'800'000'000'000, .person = person});
  };
  const auto not_in_file = [&] { return bench.loops[0].settings->gains_not_in_file(); };
  tune(0.5, true);
  REQUIRE(not_in_file());
  CHECK(not_in_file()->file.kp == 0.35);

  SECTION("refused, with who set them, and the other changes are not applied either") {
    bench.write("loops.d/a.yaml", with(kLoop, "ki: 0.04", "ki: 0.05"));
    bench.write("loopwardend.yaml", "log_level: debug\n");
    const json dry = bench.done(bench.reloader->post("uid 1000", true, false));
    CHECK(dry.at("outcome") == "refused");
    CHECK(dry.at("take_file_needed") == true);
    CHECK_THAT(dry.at("lines").back().get<std::string>(),
               Catch::Contains("ella by page") && Catch::Contains("2027-01-15T08:00:00Z") &&
                   Catch::Contains("controller.kp 0.5 -> 0.35, controller.ki 0.04 -> 0.05"));
    CHECK(bench.reloader->status().refused.empty());
    const json refused = bench.reload();
    CHECK(refused.at("outcome") == "refused");
    CHECK(refused.at("take_file_needed") == true);
    CHECK_THAT(refused.at("why").get<std::string>(), Catch::Contains("--take-file"));
    CHECK(bench.kp() == 0.5);
    CHECK(bench.log_level.empty());
    CHECK_FALSE(bench.reloader->status().files_in_force);

    const json taken = bench.reload(true);
    CHECK(taken.at("outcome") == "in_force");
    CHECK(bench.kp() == 0.35);
    CHECK_FALSE(not_in_file());
  }
  SECTION("a file that has them by now is taken, and they are in a file") {
    bench.write("loops.d/a.yaml", with(kLoop, "kp: 0.35", "kp: 0.5"));
    CHECK(bench.reload().at("outcome") == "in_force");
    CHECK(bench.kp() == 0.5);
    CHECK_FALSE(not_in_file());
    // The next file with other gains is a normal change.
    bench.write("loops.d/a.yaml", kLoop);
    CHECK(bench.reload().at("outcome") == "in_force");
    CHECK(bench.kp() == 0.35);
  }
  SECTION("a master's gains are replaced, as before") {
    tune(0.6, false);
    CHECK(bench.reload().at("outcome") == "in_force");
    CHECK(bench.kp() == 0.35);
  }
  SECTION("gains that arrived while the file's were on their way are not in the file") {
    bench.write("loops.d/a.yaml", with(kLoop, "limits: [1, 9]", "limits: [1, 4]"));
    CHECK(bench.reload(true).at("outcome") == "waits");
    tune(0.7, true);
    bench.loops[0].channels->operator_commands.commands.try_push({.number = 2, .output = 3.0});
    bench.run(2);
    bench.reloader->step();
    CHECK(bench.kp() == 0.7);
    REQUIRE(not_in_file());
    CHECK(not_in_file()->author.by == "ella by page");
  }
}

TEST_CASE("limits that wait are in force with CO, unless a later reload changes them",
          "[app][reload]") {
  Bench bench;
  const std::string narrow =
      with(with(kLoop, "limits: [1, 9]", "limits: [1, 4]"), "kp: 0.35", "kp: 0.5");
  bench.write("loops.d/a.yaml", narrow);
  CHECK(bench.reload().at("outcome") == "waits");
  CHECK(bench.waiting("waiting_for_output") == 2);
  CHECK(bench.kp() == 0.35);
  const auto move_output = [&](double to) {
    bench.loops[0].channels->operator_commands.commands.try_push({.number = 1, .output = to});
    bench.run(2);
    bench.reloader->step();
  };
  SECTION("CO moves inside") {
    move_output(3.0);
    CHECK(bench.kp() == 0.5);
    CHECK(bench.waiting("waiting_for_output") == 0);
    CHECK(bench.reloader->config_hash() == bench.reloader->status().files_hash);
  }
  SECTION("the next reload keeps the loop whole") {
    bench.write("loops.d/a.yaml", with(narrow, "unit: V", "unit: mA"));
    CHECK(bench.reload().at("outcome") == "waits");
    CHECK(bench.waiting("waiting_for_output") == 0);
    move_output(3.0);
    CHECK(bench.kp() == 0.35);
  }
  SECTION("the next reload has errors") {
    bench.write("loops.d/a.yaml", "");
    CHECK(bench.reload().at("outcome") == "refused");
    CHECK(bench.waiting("waiting_for_output") == 2);
    move_output(3.0);
    CHECK(bench.kp() == 0.5);
  }
}

TEST_CASE("a master's gains are shown as those that a reload replaces", "[app][reload]") {
  Bench bench;
  REQUIRE(bench.loops[0].channels->master_commands.commands.try_push({.number = 1, .kp = 3.0}));
  bench.run(1);
  CHECK(bench.kp() == 3.0);
  const json result = bench.reload();
  CHECK(result.at("plan").at("loops")[0].at("applied")[0] ==
        json{{"key", "controller.kp"}, {"from", "3"}, {"to", "0.35"}});
  CHECK(bench.kp() == 0.35);
}

TEST_CASE("at most eight reloads wait, and signals count as one", "[app][reload]") {
  Bench bench;
  for (int i = 0; i < 7; ++i) bench.reloader->post("uid 1000", true, false);
  for (int i = 0; i < 5; ++i) bench.reloader->by_signal();
  CHECK_THROWS_WITH(bench.reloader->post("uid 1000", true, false),
                    Catch::Contains("try again later"));
  CHECK(bench.done(8).at("outcome") == "in_force");
  CHECK(bench.reloading == 1);
  CHECK_NOTHROW(bench.reloader->post("uid 1000", true, false));
}

TEST_CASE("a loop whose next cycle is far away does not hold up the reload", "[app][reload]") {
  Bench bench;
  bench.write("loops.d/a.yaml", with(kLoop, "kp: 0.35", "kp: 0.5"));
  const std::uint64_t number = bench.reloader->post("uid 1000", false, false);
  json state;
  REQUIRE(test::eventually([&] {
    bench.reloader->step();
    state = *bench.reloader->state(number);
    return state.at("state") == "done";
  }));
  CHECK(state.at("outcome") == "waits");
  CHECK(bench.waiting("waiting_for_output") == 1);
  bench.run(1);
  bench.reloader->step();
  CHECK(bench.waiting("waiting_for_output") == 0);
  CHECK(bench.kp() == 0.5);
}

}  // namespace loopwarden::tests::reloader_test
