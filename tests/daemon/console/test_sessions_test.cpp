// SPDX-License-Identifier: Apache-2.0
// Small tests of a valve: their moves, their limits, and the state of the loop after each end.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "model/numeric/random.hpp"
#include "tests/daemon/console/tested_loop.hpp"

namespace loopwarden::daemon::test_sessions_test {
namespace {

using console_bench::json;
using console_bench::TestedLoop;
using control::Mode;

std::string error_of(const json& answer) { return answer.value("error", std::string()); }

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a test by SP moves in automatic and gives the set point back") {
  TestedLoop loop;
  REQUIRE(loop.begin(1.5, false).at("ok") == true);
  CHECK(loop.mode() == Mode::automatic);
  REQUIRE(loop.move(51.5).at("ok") == true);
  CHECK(loop.move(51.5).at("try_again") == true);  // no cycle has taken the first one
  loop.run_for(20.0);
  CHECK(loop.set_point() == 51.5);
  // A restart would continue with the set point from before the test.
  CHECK(LastCommandsFile(loop.folder / "orders").load().loops.at("FIC-101").set_point == 50.0);
  const json beyond = loop.move(51.6);
  CHECK(has(error_of(beyond), "SP 51.6 is outside"));
  CHECK_FALSE(beyond.contains("try_again"));
  CHECK(has(
      error_of(loop.request({{"request", "set"}, {"set_point", 51.0}, {"session", *loop.session}})),
      "with `move`"));
  CHECK(has(error_of(loop.request({{"request", "set"}, {"set_point", 51.0}})), "out of service"));
  REQUIRE(loop.end().at("ok") == true);
  loop.run_for(3.0);
  CHECK(loop.released());
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.set_point() == 50.0);
}

TEST_CASE("a test of the output returns to automatic without a bump") {
  TestedLoop loop;
  const double before = loop.row().co;
  REQUIRE(loop.begin(3.0, true).at("ok") == true);
  loop.run_for(1.0);
  CHECK(loop.mode() == Mode::manual);
  REQUIRE(loop.move(before + 3.0).at("ok") == true);
  loop.run_for(10.0);
  CHECK(loop.row().co == Approx(before + 3.0));
  loop.end();
  double largest = 0.0;
  double last = loop.row().co;
  for (int i = 0; i < 50; ++i) {
    loop.run_for(0.2);
    largest = std::max(largest, std::abs(loop.row().co - last));
    last = loop.row().co;
  }
  CHECK(largest < 3.2);
  CHECK(loop.released());
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.set_point() == 50.0);
}

TEST_CASE("no test begins on a loop that is not fit for it") {
  TestedLoop loop;
  SECTION("an active process alarm") {
    loop.alarm(alarm::AlarmKind::pv_high, true);
    CHECK(has(error_of(loop.begin(1.0, false)), "pv_high"));
  }
  SECTION("a fault") {
    loop.io().set_pv(50.0, hal::Quality::bad);
    loop.pv_forced = true;
    loop.run_for(2.0);
    CHECK(has(error_of(loop.begin(1.0, false)), "PV"));
  }
  SECTION("in manual, a test by SP") {
    loop.request({{"request", "set"}, {"mode", "man"}});
    loop.run_for(1.0);
    CHECK(has(error_of(loop.begin(1.0, false)), "automatic"));
  }
  SECTION("a move of more than 5 % of the span") {
    CHECK(has(error_of(loop.begin(5.5, false)), "more than 5 %"));
    CHECK(has(error_of(loop.begin(5.5, true)), "more than 5 %"));
  }
  SECTION("limits beyond those of the loop") {
    json terms = loop.terms(1.0, false);
    terms["co"] = {-1.0, 80.0};
    CHECK(has(error_of(loop.request({{"test", terms}})), "limits of CO"));
    terms = loop.terms(1.0, false);
    terms["longest_s"] = 3601.0;
    CHECK(has(error_of(loop.request({{"test", terms}})), "at most 3600 s"));
    terms = loop.terms(1.0, false);
    terms.erase("pv");
    CHECK(loop.request({{"test", terms}}).at("ok") == false);
  }
  SECTION("another session on the box") {
    REQUIRE(loop.request({}).at("ok") == true);
    CHECK(has(error_of(loop.begin(1.0, false)), "needs the box for itself"));
  }
  loop.run_for(0.4);
  CHECK(loop.set_point() == 50.0);
}

TEST_CASE("the holder learns why its test has ended") {
  TestedLoop loop;
  REQUIRE(loop.begin(1.5, false).at("ok") == true);
  loop.move(51.5);
  loop.pv_offset = 20.0;
  loop.run_for(3.0);
  CHECK(has(loop.told, "PV 7"));
  CHECK(has(loop.told, "is outside of 40 to 60"));
  CHECK(loop.released());
  CHECK(loop.set_point() == 50.0);
}

TEST_CASE("a valve test without a plan moves far, and is restored if the workbench dies") {
  TestedLoop loop;
  const double before = loop.row().co;
  json terms = loop.terms(30.0, true);
  terms["pv"] = {-10.0, 110.0};
  terms["longest_s"] = 7200.0;
  CHECK(has(error_of(loop.request({{"test", terms}})), "outside of its range"));
  terms["any_size"] = true;
  const console::Sender page{console::SocketName::page, "page"};
  CHECK(has(error_of(loop.request({{"test", terms}}, page)), "control.sock alone"));
  loop.alarm(alarm::AlarmKind::deviation, true);
  const json begun = loop.request({{"test", terms}});
  REQUIRE(begun.at("ok") == true);
  const std::uint64_t session = begun.at("session");
  loop.run_for(1.0);
  REQUIRE(loop.request({{"session", session}, {"move", before - 25.0}}).at("ok") == true);
  loop.run_for(20.0);
  CHECK(loop.row().co == Approx(before - 25.0));
  CHECK(has(error_of(loop.request({{"session", session}, {"move", before - 30.1}})), "outside"));
  loop.run_for(35.0);
  CHECK(loop.mode() == Mode::manual);
  // From here on the workbench has been silent for 60 s: the last move was at 1 s.
  loop.run_for(30.0);
  CHECK(loop.released());
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.set_point() == 50.0);
}

TEST_CASE("the page only tests, and the loop is restored if it dies") {
  TestedLoop loop;
  const console::Sender page{console::SocketName::page, "ella@10.0.0.5 by page (uid 997)"};
  CHECK(has(error_of(loop.request({}, page)), "except for a test"));
  CHECK(has(error_of(loop.request({{"request", "reload"}}, page)), "except with dry_run"));
  const json begun = loop.request({{"test", loop.terms(1.5, false)}}, page);
  REQUIRE(begun.at("ok") == true);
  const std::uint64_t session = begun.at("session");
  REQUIRE(loop.request({{"session", session}, {"move", 51.5}}, page).at("ok") == true);
  loop.run_for(50.0);
  CHECK(loop.set_point() == 51.5);
  loop.run_for(15.0);
  CHECK(loop.released());
  CHECK(loop.mode() == Mode::automatic);
  CHECK(loop.set_point() == 50.0);
  const json lines = loop.ask(R"({"request": "journal", "kind": "test"})").at("lines");
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].at("reason") == "no sign of life for 60 s");
  CHECK(lines[1].at("peer") == page.peer);
}

TEST_CASE("the result of a test is in the journal with its prediction") {
  TestedLoop loop;
  const json asked{
      {"request", "test_result"}, {"loop", "FIC-101"}, {"explanations", "stiction or backlash"},
      {"decided", "stiction"},    {"predicted", 0.96}, {"probability", 0.985}};
  CHECK(loop.ask(asked.dump()).at("ok") == true);
  const json lines = loop.ask(R"({"request": "journal", "kind": "test"})").at("lines");
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].at("old") == "stiction or backlash: 0.960");
  CHECK(lines[0].at("new") == "stiction: 0.985");
}

// --- fault campaign ---

namespace {

enum class Fault {
  none,
  workbench_killed,
  daemon_killed,
  device_lost,
  read_back_lost,
  pv_limit,
  bad_pv,
  process_alarm,
  reload,
  second_person,
  taken_to_manual,
  clock_step
};
constexpr int kFaults = 12;

struct Injected {
  Fault fault;
  bool by_output, from_manual, set_point_tracks, manual_recovery;
  double at_s;  // after the first move
  double size;  // PV or CO units
};

std::string text_of(const Injected& i) {
  constexpr std::array<const char*, kFaults> kNames{
      "none",           "workbench killed", "daemon killed",   "device lost",
      "read-back lost", "PV limit",         "bad PV",          "process alarm",
      "reload",         "second person",    "taken to manual", "clock step"};
  return std::string(kNames[static_cast<std::size_t>(i.fault)]) +
         (i.by_output ? ", output" : ", SP") + (i.from_manual ? " from manual" : "") +
         (i.set_point_tracks ? ", SP tracks" : "") + (i.manual_recovery ? ", to manual" : "") +
         ", after " + std::to_string(i.at_s) + " s, size " + std::to_string(i.size);
}

Injected draw(numeric::Random& random) {
  Injected i{};
  i.fault = static_cast<Fault>(static_cast<int>(random.uniform(0.0, kFaults)));
  i.by_output = random.uniform() < 0.5;
  i.from_manual = i.by_output && random.uniform() < 0.3;
  i.set_point_tracks = random.uniform() < 0.3;
  i.manual_recovery = random.uniform() < 0.3;
  i.at_s = 20.0 * random.uniform();
  i.size = (random.uniform() < 0.5 ? -1.0 : 1.0) * (0.5 + 2.5 * random.uniform());
  return i;
}

// Injects one fault into a test and returns how the loop differs from where a test must leave it;
// empty: it does not.
std::string difference_after(const Injected& injected) {
  TestedLoop loop(
      injected.manual_recovery ? control::Recovery::manual : control::Recovery::previous_mode,
      injected.set_point_tracks);
  if (injected.from_manual) {
    loop.request({{"request", "set"}, {"mode", "man"}});
    loop.run_for(5.0);
  }
  const double output_before = loop.row().co;
  const double from = injected.by_output ? output_before : 50.0;
  if (const json answer = loop.begin(injected.size, injected.by_output); answer.at("ok") != true) {
    return "the test did not begin: " + error_of(answer);
  }
  loop.run_for(1.0);
  if (const json answer = loop.move(from + injected.size); answer.at("ok") != true) {
    return "the loop did not move: " + error_of(answer);
  }
  loop.run_for(injected.at_s);

  bool wanted_manual = injected.from_manual;
  bool wanted_end = true;  // by the daemon itself
  bool keeps_output = false;
  switch (injected.fault) {
    case Fault::none: wanted_end = false; break;
    case Fault::workbench_killed: loop.workbench_alive = false; break;
    case Fault::daemon_killed:
      loop.kill_daemon();
      keeps_output = true;
      break;
    case Fault::device_lost:
      loop.device_lost = true;
      wanted_manual = wanted_manual || injected.manual_recovery;
      keeps_output = true;
      break;
    case Fault::read_back_lost:
      loop.read_back = false;
      loop.io().inputs.valve_position.quality = hal::Quality::bad;
      break;
    case Fault::pv_limit: loop.pv_offset = 15.0; break;
    case Fault::bad_pv:
      loop.pv_forced = true;
      loop.io().set_pv(50.0, hal::Quality::bad);
      // A test of the output ends, too: in automatic, the safe action of the loop follows.
      wanted_manual = wanted_manual || injected.manual_recovery;
      keeps_output = !injected.from_manual;
      loop.run_for(7.0);
      break;
    case Fault::process_alarm: loop.alarm(alarm::AlarmKind::rate_of_change, true); break;
    case Fault::reload: {
      rt::LoopSettings settings = loop.loops[0].settings->get();
      settings.safety.on_stop = control::OutputAction::go_to(7.0);
      loop.offer(settings);
      loop.run_for(2.0);
      if (loop.offer_taken()) return "settings changed in a test";
      wanted_end = false;
      break;
    }
    case Fault::second_person:
      if (loop.request({{"test", loop.terms(1.0, injected.by_output)}}).at("ok") == true ||
          loop.request({{"request", "set"}, {"set_point", 45.0}}).at("ok") == true ||
          loop.request({{"request", "set"}, {"output", 30.0}}).at("ok") == true ||
          loop.request({{"request", "tune"}, {"kp", 1.0}, {"ki", 0.1}, {"kd", 0.0}}).at("ok") ==
              true) {
        return "a second person commanded the loop";
      }
      wanted_end = false;
      break;
    case Fault::taken_to_manual:
      if (loop.request({{"request", "set"}, {"mode", "man"}}).at("ok") != true) {
        return "nobody can take the loop to manual";
      }
      wanted_manual = keeps_output = true;
      break;
    case Fault::clock_step:
      loop.now_ms += 86'400'000 * (injected.at_s < 10.0 ? 1 : -1);
      wanted_end = false;
      break;
  }
  loop.run_for(3.0);
  if (!wanted_end && !loop.session) return "the test ended: " + loop.told;
  if (!wanted_end) loop.end();
  // A process fault passes; silence takes a minute.
  loop.device_lost = loop.pv_forced = false;
  loop.pv_offset = 0.0;
  if (injected.fault == Fault::bad_pv) loop.io().set_pv(50.0, hal::Quality::good);
  loop.run_for(injected.fault == Fault::workbench_killed ? 75.0 : 15.0);

  if (!loop.released()) return "the loop is still out of service";
  if (loop.workbench_alive && loop.session) return "the holder does not learn of the end";
  const Mode wanted = wanted_manual ? Mode::manual : Mode::automatic;
  if (loop.mode() != wanted) return "the mode differs";
  const bool follows_pv = wanted == Mode::manual && injected.set_point_tracks;
  if (!follows_pv && loop.set_point() != 50.0) {
    return "the set point is " + std::to_string(loop.set_point());
  }
  if (injected.from_manual && !keeps_output && std::abs(loop.io().written - output_before) > 0.3) {
    return "the output is " + std::to_string(loop.io().written) + ", not " +
           std::to_string(output_before);
  }
  if (injected.fault == Fault::reload && !loop.offer_taken()) return "the reload is lost";
  return {};
}

void run_campaign(std::uint64_t seed, int faults) {
  numeric::Random random(seed);
  int restored = 0;
  for (int i = 0; i < faults; ++i) {
    const Injected injected = draw(random);
    const std::string difference = difference_after(injected);
    INFO(text_of(injected));
    CHECK(difference == "");
    restored += difference.empty() ? 1 : 0;
  }
  WARN(faults << " faults in tests, valve as a test must leave it: " << restored);
}

}  // namespace

TEST_CASE("after a fault in a test, the loop is where a test must leave it") {
  run_campaign(1, 20);
}

// The figures of docs/reference/limits.md: bin/tests_daemon "[test_campaign]"
TEST_CASE("after 500 faults in tests, every loop is where a test must leave it",
          "[.][test_campaign]") {
  run_campaign(53, 500);
}

}  // namespace loopwarden::daemon::test_sessions_test
