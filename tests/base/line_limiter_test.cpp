// SPDX-License-Identifier: Apache-2.0
#include "base/line_limiter.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace line_limiter_test {

using namespace std::chrono_literals;
using loopwarden::base::LimitedLine;
using loopwarden::base::LineLimiter;

namespace {

struct Log {
  void take(const std::string& subject, const std::string& state, std::chrono::milliseconds at) {
    const LimitedLine line{.good = state == "up", .text = subject + " " + state};
    if (auto written = limiter.take(subject, state, line, LineLimiter::Moment(at))) {
      lines.push_back(written->text);
    }
  }
  void look(std::chrono::milliseconds at) {
    for (const LimitedLine& line : limiter.due(LineLimiter::Moment(at))) lines.push_back(line.text);
  }
  LineLimiter limiter;
  std::vector<std::string> lines;
};

}  // namespace

TEST_CASE("a link that flaps writes one line per state and minute", "[log]") {
  Log log;
  for (int i = 0; i < 1200; ++i) {  // two changes per second for ten minutes
    log.take("a", i % 2 == 0 ? "down" : "up", i * 500ms);
    log.look(i * 500ms);
  }
  CHECK(log.lines.size() == 20);
  CHECK(log.lines[0] == "a down");
  CHECK(log.lines[1] == "a up");
  CHECK(log.lines[2] == "a down (59 more such lines since the last one)");
}

TEST_CASE("subjects and states don't withhold each other's lines", "[log]") {
  Log log;
  log.take("a", "down", 0ms);
  log.take("b", "down", 1ms);
  log.take("a", "late", 2ms);
  CHECK(log.lines.size() == 3);
}

TEST_CASE("the log ends with the state that lasts", "[log]") {
  Log log;
  log.take("a", "down", 0ms);
  log.take("a", "up", 100ms);
  log.take("a", "down", 200ms);  // and stays down
  for (int i = 0; i < 300; ++i) log.look(i * 1000ms);
  REQUIRE(log.lines.size() == 3);
  CHECK(log.lines.back() == "a down");

  log.take("a", "up", 301s);
  log.take("a", "down", 302s);
  // withheld; after the next change the last written line is right again
  log.take("a", "up", 303s);
  log.take("a", "down", 304s);
  for (int i = 305; i < 500; ++i) log.look(i * 1000ms);
  REQUIRE(log.lines.size() == 5);
  CHECK(log.lines.back() == "a down");
}

}  // namespace line_limiter_test
