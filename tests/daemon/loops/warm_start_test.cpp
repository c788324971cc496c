// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/warm_start.hpp"

#include <catch2/catch.hpp>

#include <filesystem>
#include <fmt/format.h>
#include <string>

#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::warm_start_test {
namespace {

using config::Start;
using control::Mode;

config::LoopConfig loop_config(Start::AfterRestart after = Start::AfterRestart::resume) {
  config::LoopConfig loop;
  loop.name = "FIC-101";
  loop.pv_unit = "m3/h";
  loop.pv.low = 0.0;
  loop.pv.high = 25.0;
  loop.controller.set_point.low = 0.0;
  loop.controller.set_point.high = 20.0;
  loop.start = {.mode = Mode::automatic,
                .set_point = 12.0,
                .after_restart = after,
                .output_is_told = true,
                .output = {}};
  return loop;
}

LastCommand last_order() {
  return {.mode = Mode::automatic,
          .set_point = 12.4,
          .pv_unit = "m3/h",
          .pv_range = {0.0, 25.0},
          .commissioned = false,
          .manual_after_fault = false};
}

LastCommands known(const LastCommand& order, const std::string& tag = "FIC-101") {
  return {.loops = {{tag, order}}, .known = true, .damaged = {}};
}

}  // namespace

TEST_CASE("a loop continues with the mode and set point of the last command", "[restart]") {
  const WarmStart warm = warm_start(loop_config(), known(last_order()));
  CHECK(warm.start.mode == Mode::automatic);
  CHECK(warm.start.set_point == 12.4);
  REQUIRE(warm.line);
  CHECK(warm.line->what == "restart");
  CHECK(warm.line->loop == "FIC-101");
  CHECK(warm.line->old_value == "AUTO, SP 12.4 m3/h");
  CHECK(warm.line->new_value == "AUTO, SP 12.4 m3/h");
  CHECK(warm.line->reason == "start.after_restart is continue; the file has AUTO, SP 12 m3/h");
  LastCommand manual = last_order();
  manual.mode = Mode::manual;
  const WarmStart by_hand = warm_start(loop_config(), known(manual));
  CHECK(by_hand.start.mode == Mode::manual);
  CHECK(by_hand.line->new_value == "MAN, SP 12.4 m3/h");
}

TEST_CASE("manual waits in manual, and file takes the file's values; the journal names both",
          "[restart]") {
  const WarmStart manual =
      warm_start(loop_config(Start::AfterRestart::manual), known(last_order()));
  CHECK(manual.start.mode == Mode::manual);
  CHECK(manual.line->old_value == "AUTO, SP 12.4 m3/h");
  const WarmStart file = warm_start(loop_config(Start::AfterRestart::file), known(last_order()));
  CHECK(file.start.mode == Mode::automatic);
  CHECK(file.start.set_point == 12.0);
  CHECK(file.line->old_value == "AUTO, SP 12.4 m3/h");
  CHECK(file.line->new_value == "AUTO, SP 12 m3/h");
}

TEST_CASE("without saved commands the file decides, and no line is written", "[restart]") {
  const WarmStart first = warm_start(loop_config(), {});
  CHECK(first.start.mode == Mode::automatic);
  CHECK(first.start.set_point == 12.0);
  CHECK_FALSE(first.line);
  // The command equals the file.
  LastCommand same = last_order();
  same.set_point = 12.0;
  CHECK_FALSE(warm_start(loop_config(), known(same)).line);
  // A loop that is new or has a new tag.
  const WarmStart renamed = warm_start(loop_config(), known(last_order(), "FIC-100"));
  CHECK(renamed.start.set_point == 12.0);
  REQUIRE(renamed.line);
  CHECK(renamed.line->old_value == "not known");
}

TEST_CASE("in doubt a loop waits in manual, with the reason in the journal", "[restart]") {
  config::LoopConfig loop = loop_config();
  LastCommand last = last_order();
  std::string why;
  SECTION("it was being commissioned") {
    last.commissioned = true;
    why = "was being commissioned";
  }
  SECTION("a fault that ends in manual was present") {
    last.manual_after_fault = true;
    why = "had a fault";
  }
  SECTION("the set point is outside narrower limits") {
    loop.controller.set_point.high = 12.2;
    why = "set point 12.4 is outside its limits 0 to 12.2";
  }
  SECTION("the numbers have another meaning") {
    loop.pv_unit = "L/min";
    why = "PV was in 0 to 25 m3/h before, and is in 0 to 25 L/min";
  }
  SECTION("the range is another one") {
    loop.pv.high = 250.0;
    why = "0 to 250";
  }
  SECTION("the position of the output is unknown") {
    loop.start.output_is_told = false;
    why = "the position of the output is unknown";
  }
  const WarmStart warm = warm_start(loop, known(last));
  CHECK(warm.start.mode == Mode::manual);
  CHECK(warm.start.set_point <= loop.controller.set_point.high);
  REQUIRE(warm.line);
  CHECK_THAT(warm.line->reason, Catch::Contains(why) && Catch::Contains("waits in manual"));
}

TEST_CASE("an unreadable file of last commands makes loops wait in manual", "[restart]") {
  const tests::TemporaryFolder folder;
  const LastCommandsFile file(folder / "last-orders.json");
  const LastCommands none = file.load();
  CHECK_FALSE(none.known);
  CHECK(none.damaged.empty());
  REQUIRE(file.save({{"FIC-101", last_order()}}).empty());
  CHECK(file.load().loops.at("FIC-101") == last_order());
  CHECK(file.load().known);
  const std::string good = *base::read_file(folder / "last-orders.json");
  std::string text = good;
  SECTION("empty") { text.clear(); }
  SECTION("cut") { text.resize(text.size() / 2); }
  SECTION("another digit") { text[text.find("12.4")] = '9'; }
  SECTION("no text") { text = std::string(100, '\0'); }
  REQUIRE_FALSE(base::replace_file(folder / "last-orders.json", text));
  const LastCommands damaged = file.load();
  CHECK(damaged.loops.empty());
  CHECK_FALSE(damaged.damaged.empty());
  CHECK(std::filesystem::exists(folder / "last-orders.json.damaged"));
  const WarmStart warm = warm_start(loop_config(), damaged);
  CHECK(warm.start.mode == Mode::manual);
  CHECK_THAT(warm.line->reason, Catch::Contains("the last orders are not known"));
  CHECK(warm_start(loop_config(Start::AfterRestart::file), damaged).start.mode == Mode::automatic);
}

TEST_CASE("a file of another version is ignored", "[restart]") {
  std::string text = text_of({{"FIC-101", last_order()}});
  CHECK(read_last_orders(text).size() == 1);
  CHECK_THROWS_WITH(read_last_orders("deadbeef\n{}\n"), Catch::Contains("checksum"));
  // With a valid checksum.
  const std::string body = "{\"loops\":{},\"version\":2}\n";
  CHECK_THROWS_WITH(read_last_orders(fmt::format("{:08x}\n{}", base::crc32(body), body)),
                    Catch::Contains("version 2"));
}

}  // namespace loopwarden::daemon::warm_start_test
