// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/output_knowledge.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::daemon::rt::output_knowledge_test {
namespace {

using control::Fault;
using control::OutputAction;

constexpr std::int64_t kSecond = 1'000'000'000;

OutputKnowledge::Cycle cycle_at(std::int64_t now_ns, bool fitted = true) {
  OutputKnowledge::Cycle cycle;
  cycle.now_ns = now_ns;
  cycle.started = true;
  cycle.read_back.fitted = fitted;
  cycle.max_age_s = 2.0;
  return cycle;
}

OutputKnowledge::Cycle read_at(std::int64_t now_ns, double value, std::int64_t measured_ns) {
  OutputKnowledge::Cycle cycle = cycle_at(now_ns);
  cycle.read_back = {.fitted = true, .good = true, .value = value, .time_ns = measured_ns};
  return cycle;
}

OutputKnowledge known_by_read_back() {
  OutputKnowledge output{OutputAction::hold()};
  output.update(read_at(kSecond, 30.0, kSecond));
  output.set_command_written();
  return output;
}

}  // namespace

TEST_CASE("the output is unknown until a source gives its position", "[output_knowledge]") {
  OutputKnowledge output{OutputAction::hold()};
  CHECK_FALSE(output.update(cycle_at(kSecond)));
  CHECK_FALSE(output.valid());

  SECTION("a good read-back") {
    CHECK(output.update(read_at(2 * kSecond, 30.0, 2 * kSecond)) == 30.0);
    CHECK_FALSE(output.reported());
  }
  SECTION("an operator") {
    CHECK(output.report());
    CHECK(output.reported());
    CHECK_FALSE(output.report());
  }
  CHECK(output.valid());
}

TEST_CASE("the start value is used once, after the start", "[output_knowledge]") {
  OutputKnowledge output{OutputAction::go_to(40.0)};
  OutputKnowledge::Cycle cycle = cycle_at(kSecond, false);
  cycle.fault = Fault::starting;
  cycle.started = false;
  CHECK_FALSE(output.update(cycle));
  CHECK(output.update(cycle_at(2 * kSecond, false)) == 40.0);
  CHECK_FALSE(output.update(cycle_at(3 * kSecond, false)));

  OutputKnowledge with_read_back = OutputKnowledge{OutputAction::go_to(40.0)};
  with_read_back.update(read_at(kSecond, 30.0, kSecond));
  cycle = cycle_at(2 * kSecond);
  cycle.output_lost = true;
  with_read_back.update(cycle);
  CHECK_FALSE(with_read_back.update(cycle_at(3 * kSecond)));
  CHECK_FALSE(with_read_back.valid());
}

TEST_CASE("a position reported before the first command does not expire at the start",
          "[output_knowledge]") {
  OutputKnowledge output{OutputAction::hold()};
  OutputKnowledge::Cycle starting = read_at(kSecond, 30.0, kSecond);
  starting.fault = Fault::starting;
  CHECK(output.update(starting) == 30.0);
  starting.now_ns += kSecond;
  starting.read_back = {.fitted = true};
  CHECK_FALSE(output.update(starting));
  CHECK_FALSE(output.valid());  // anybody may move the valve before the first command
  CHECK(output.report());
  output.update(starting);
  CHECK(output.valid());
}

TEST_CASE("after a loss only a newer read-back counts", "[output_knowledge]") {
  OutputKnowledge output = known_by_read_back();
  OutputKnowledge::Cycle lost = read_at(2 * kSecond, 31.0, kSecond);
  lost.output_lost = true;
  lost.fault = Fault::output_lost;
  CHECK_FALSE(output.update(lost));
  CHECK_FALSE(output.valid());

  OutputKnowledge::Cycle back = read_at(3 * kSecond, 31.0, kSecond);
  back.fault = Fault::output_lost;
  CHECK_FALSE(output.update(back));
  back.read_back.time_ns = 3 * kSecond;
  CHECK(output.update(back) == 31.0);
}

TEST_CASE("a late cycle makes the position unknown, and each one starts anew",
          "[output_knowledge]") {
  OutputKnowledge output = known_by_read_back();
  for (const std::int64_t now : {2 * kSecond, 3 * kSecond}) {
    OutputKnowledge::Cycle late = read_at(now, 31.0, now - 1);
    late.late_cycle = true;
    CHECK_FALSE(output.update(late));
    CHECK_FALSE(output.valid());
  }
}

TEST_CASE("a report counts until the output is lost again", "[output_knowledge]") {
  OutputKnowledge output = known_by_read_back();
  OutputKnowledge::Cycle lost = cycle_at(2 * kSecond);
  lost.output_lost = true;
  lost.fault = Fault::output_lost;
  output.update(lost);
  REQUIRE(output.report());
  output.update(lost);
  CHECK(output.valid());
  CHECK(output.reported());

  OutputKnowledge::Cycle recovering = cycle_at(3 * kSecond);
  recovering.fault = Fault::output_lost;
  output.update(recovering);
  CHECK(output.valid());
  output.update(lost);
  CHECK_FALSE(output.valid());
  CHECK_FALSE(output.reported());
}

TEST_CASE("without a read-back the last output stays valid after a loss", "[output_knowledge]") {
  OutputKnowledge output{OutputAction::go_to(40.0)};
  output.update(cycle_at(kSecond, false));
  output.set_command_written();
  OutputKnowledge::Cycle lost = cycle_at(2 * kSecond, false);
  lost.output_lost = true;
  lost.fault = Fault::output_lost;
  CHECK_FALSE(output.update(lost));
  CHECK(output.valid());
}

TEST_CASE("a stop action waits for a read-back, but not longer than its age limit",
          "[output_knowledge]") {
  OutputKnowledge::Cycle stop = cycle_at(kSecond, GENERATE(true, false));
  stop.fault = Fault::stop;
  stop.action = OutputAction::go_to(5.0);
  OutputKnowledge output{OutputAction::go_to(40.0)};
  if (stop.read_back.fitted) {
    CHECK_FALSE(output.update(stop));
    stop.now_ns = 3 * kSecond;
  }
  CHECK(output.update(stop) == 5.0);

  OutputKnowledge held{OutputAction::hold()};
  stop.action = OutputAction::hold();
  CHECK_FALSE(held.update(stop));
  CHECK_FALSE(held.valid());
}

TEST_CASE("while commands are withheld the position is unknown", "[output_knowledge]") {
  SECTION("with a read-back a newer measurement ends it") {
    OutputKnowledge output = known_by_read_back();
    OutputKnowledge::Cycle withheld = read_at(2 * kSecond, 31.0, 2 * kSecond);
    withheld.withhold = true;
    CHECK_FALSE(output.update(withheld));
    CHECK_FALSE(output.valid());
    CHECK_FALSE(output.update(read_at(3 * kSecond, 31.0, kSecond)));
    CHECK(output.update(read_at(3 * kSecond, 32.0, 3 * kSecond)) == 32.0);
  }
  SECTION("without one the last output is valid again") {
    OutputKnowledge output{OutputAction::go_to(40.0)};
    output.update(cycle_at(kSecond, false));
    OutputKnowledge::Cycle withheld = cycle_at(2 * kSecond, false);
    withheld.withhold = true;
    output.update(withheld);
    output.update(withheld);
    CHECK_FALSE(output.valid());
    CHECK_FALSE(output.update(cycle_at(3 * kSecond, false)));
    CHECK(output.valid());
  }
}

TEST_CASE("written commands and rejected results are remembered", "[output_knowledge]") {
  OutputKnowledge output{OutputAction::hold()};
  CHECK_FALSE(output.command_written());
  CHECK_FALSE(output.result_rejected());
  output.set_command_written();
  output.set_result_rejected(true);
  CHECK(output.command_written());
  CHECK(output.result_rejected());
  output.set_result_rejected(false);
  CHECK_FALSE(output.result_rejected());
}

}  // namespace loopwarden::daemon::rt::output_knowledge_test
