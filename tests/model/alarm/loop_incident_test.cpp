// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/loop_incident.hpp"

#include <catch2/catch.hpp>
#include <initializer_list>
#include <string>
#include <utility>

namespace loop_incident_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using loopwarden::effects::Block;

namespace {

using K = AlarmKind;
using Change = IncidentChange::Kind;
constexpr std::int64_t kMinute = 60'000;

AlarmConditions with(std::initializer_list<K> on) {
  AlarmConditions conditions{};
  for (const K kind : on) conditions[index_of(kind)] = {true, 5.0};
  return conditions;
}

// A loop's alarms and its incident, with the steps of the daemon.
struct Loop {
  LoopAlarms alarms{AlarmSettings{}};
  LoopIncident incident;

  LoopIncident::Changes shows(std::int64_t now_ms, std::initializer_list<K> on) {
    alarms.window_judged(now_ms, with(on));
    return incident.follow(now_ms, alarms);
  }
  const Incident& now() const { return incident.incident(); }
};

IncidentExplanation says(std::string effect, Block block, double confidence) {
  return {.alarm = K::model_gap,
          .raised_ms = kMinute,
          .from_ms = kMinute / 2,
          .effect = std::move(effect),
          .block = block,
          .confidence = confidence};
}

}  // namespace

TEST_CASE("one change that raises three alarms is one incident", "[monitor][incident]") {
  Loop loop;
  CHECK(loop.shows(0, {}).empty());
  CHECK_FALSE(loop.now().there());

  const auto opened = loop.shows(kMinute, {K::model_gap});
  REQUIRE(opened.size() == 1);
  CHECK(opened.front().kind == Change::opened);
  CHECK(opened.front().alarm == K::model_gap);
  CHECK(loop.now().name == kNotAsCommissioned);
  CHECK_FALSE(loop.now().cause);

  const auto joined = loop.shows(8 * kMinute, {K::model_gap, K::stiction});
  REQUIRE(joined.size() == 2);
  CHECK(joined.front().kind == Change::joined);
  CHECK(joined.back().kind == Change::renamed);
  CHECK(joined.back().from == kNotAsCommissioned);
  CHECK(loop.now().name == "stiction");
  CHECK(loop.now().cause == Block::valve);
  CHECK(loop.now().opened_ms == kMinute);

  SECTION("a second name joins; the first stays") {
    loop.shows(9 * kMinute, {K::model_gap, K::stiction, K::backlash});
    CHECK(loop.now().name == "stiction");
    CHECK(loop.now().has(K::backlash));
    // Though the order of alarms has stiction first, the first raised alarm counts.
    Loop other;
    other.shows(kMinute, {K::backlash});
    other.shows(2 * kMinute, {K::backlash, K::stiction});
    CHECK(other.now().name == "backlash");
  }
  SECTION("low air explains the others") {
    loop.shows(9 * kMinute, {K::stiction, K::low_air_supply});
    CHECK(loop.now().name == "low_air_supply");
  }
  SECTION("acknowledged once all alarms are; a later one waits again") {
    CHECK(unacknowledged(loop.now(), loop.alarms));
    REQUIRE(loop.alarms.act(K::stiction, AlarmAction::acknowledge, 9 * kMinute).accepted);
    CHECK(unacknowledged(loop.now(), loop.alarms));
    REQUIRE(loop.alarms.act(K::model_gap, AlarmAction::acknowledge, 9 * kMinute).accepted);
    CHECK_FALSE(unacknowledged(loop.now(), loop.alarms));
    loop.shows(10 * kMinute, {K::model_gap, K::stiction, K::hysteresis});
    CHECK(unacknowledged(loop.now(), loop.alarms));
  }
}

TEST_CASE("an incident ends half an hour after its last alarm", "[monitor][incident]") {
  Loop loop;
  loop.shows(kMinute, {K::stiction});
  loop.shows(20 * kMinute, {});
  CHECK(loop.shows(49 * kMinute, {}).empty());
  CHECK(loop.now().open());

  SECTION("an alarm raised until then joins, and the quiet time restarts") {
    loop.shows(49 * kMinute, {K::backlash});
    CHECK(loop.now().opened_ms == kMinute);
    loop.shows(50 * kMinute, {});
    CHECK(loop.shows(79 * kMinute, {}).empty());
    CHECK(loop.shows(80 * kMinute, {}).front().kind == Change::ended);
  }
  SECTION("a later alarm opens another incident") {
    const auto ended = loop.shows(50 * kMinute, {});
    REQUIRE(ended.size() == 1);
    CHECK(ended.front().kind == Change::ended);
    CHECK_FALSE(loop.now().open());
    CHECK(loop.now().name == "stiction");
    REQUIRE(loop.shows(51 * kMinute, {K::stiction}).front().kind == Change::opened);
    CHECK(loop.now().opened_ms == 51 * kMinute);
    CHECK(loop.now().renamed.empty());
  }
  SECTION("a clock that was set back only lengthens it") {
    CHECK(loop.shows(-500 * kMinute, {}).empty());
    CHECK(loop.shows(-471 * kMinute, {}).empty());
    CHECK(loop.shows(60 * kMinute, {}).front().kind == Change::ended);
  }
}

TEST_CASE("an incident that was opened by a fast clock ends when the clock is right",
          "[monitor][incident]") {
  constexpr std::int64_t kDay = 24 * 60 * kMinute;
  constexpr std::int64_t kAhead = 400 * kDay;
  constexpr std::int64_t kRight = 20 * kDay;
  Loop loop;
  loop.shows(kAhead, {K::stiction});

  SECTION("without an alarm, after forty minutes") {
    CHECK(loop.shows(kRight, {}).empty());
    CHECK(loop.shows(kRight + 39 * kMinute, {}).empty());
    REQUIRE(loop.shows(kRight + 40 * kMinute, {}).size() == 1);
    CHECK_FALSE(loop.now().open());

    // A new incident opens then, has the right time, and accepts its explanation.
    const std::int64_t later = kRight + 365 * kDay;
    REQUIRE(loop.shows(later, {K::model_gap}).front().kind == Change::opened);
    CHECK(loop.now().opened_ms == later);
    IncidentExplanation new_one = says("gain_change", Block::process, 0.9);
    new_one.raised_ms = later;
    CHECK(loop.incident.explained(later + kMinute, new_one).size() == 1);
    CHECK(loop.now().name == "gain_change");
  }
  SECTION("its id is kept, and joining alarms are explained with it") {
    loop.shows(kRight, {K::stiction});
    loop.shows(kRight + 5 * kMinute, {K::stiction, K::model_gap});
    CHECK(loop.now().opened_ms == kAhead);
    IncidentExplanation joined = says("gain_change", Block::process, 0.9);
    joined.raised_ms = kRight + 5 * kMinute;
    loop.incident.explained(kRight + 9 * kMinute, joined);
    CHECK(loop.now().name == "gain_change");
  }
  SECTION("a late explanation of an earlier alarm does not name the next incident") {
    loop.shows(kRight, {});
    loop.shows(kRight + 40 * kMinute, {});
    loop.shows(kRight + 50 * kMinute, {K::stiction});
    IncidentExplanation late = says("gain_change", Block::process, 0.9);
    late.alarm = K::stiction;
    late.raised_ms = kAhead;
    loop.incident.explained(kRight + 51 * kMinute, late);
    CHECK(loop.now().name == "stiction");
  }
  SECTION("the daemon was restarted before the clock was right") {
    Loop after;
    after.incident.restore(loop.now());
    after.shows(kRight, {});
    CHECK(after.shows(kRight + 40 * kMinute, {}).front().kind == Change::ended);
  }
}

TEST_CASE("a short alarm leaves its incident open for forty minutes", "[monitor][incident]") {
  Loop loop;
  loop.shows(kMinute, {K::model_gap});
  loop.shows(2 * kMinute, {});
  CHECK(loop.shows(40 * kMinute, {}).empty());
  CHECK(loop.shows(41 * kMinute, {}).front().kind == Change::ended);
}

TEST_CASE("the explanation names an incident if it is sure", "[monitor][incident]") {
  Loop loop;
  loop.shows(kMinute, {K::model_gap});
  loop.shows(2 * kMinute, {K::model_gap, K::stiction});

  SECTION("a cause outside the valve is no valve fault any more") {
    const auto changes =
        loop.incident.explained(5 * kMinute, says("gain_change", Block::process, 0.93));
    REQUIRE(changes.size() == 1);
    CHECK(changes.front().from == "stiction");
    CHECK(loop.now().name == "gain_change");
    CHECK(loop.now().cause == Block::process);
    CHECK(loop.now().confidence == 0.93);
    CHECK(loop.now().from_ms == kMinute / 2);
    // An alarm that joins later does not change the name.
    loop.shows(6 * kMinute, {K::model_gap, K::stiction, K::backlash});
    CHECK(loop.now().name == "gain_change");

    SECTION("the newest explanation applies") {
      loop.incident.explained(20 * kMinute, says("stiction", Block::valve, 0.95));
      CHECK(loop.now().name == "stiction");
      REQUIRE(loop.now().renamed.size() == 3);
      CHECK(loop.now().renamed.back().from == "gain_change");
      CHECK(loop.now().renamed.back().at_ms == 20 * kMinute);
    }
    SECTION("also if it is not sure any more: then the alarms give the name") {
      loop.incident.explained(20 * kMinute, says("gain_change", Block::process, 0.5));
      CHECK(loop.now().name == "stiction");
      CHECK(loop.now().cause == Block::valve);
      CHECK_FALSE(loop.now().explained());
    }
  }
  SECTION("if it is not sure, or has no name, the alarm's name stays") {
    CHECK(loop.incident.explained(5 * kMinute, says("gain_change", Block::process, 0.89)).empty());
    CHECK(loop.incident.explained(5 * kMinute, says("", Block::process, 0.9)).empty());
    CHECK(loop.now().name == "stiction");
  }
  SECTION("it doesn't apply to an earlier alarm or another one") {
    IncidentExplanation old = says("gain_change", Block::process, 0.9);
    old.raised_ms = 0;
    CHECK(loop.incident.explained(5 * kMinute, old).empty());
    IncidentExplanation other = says("gain_change", Block::process, 0.9);
    other.alarm = K::low_air_supply;
    CHECK(loop.incident.explained(5 * kMinute, other).empty());
    CHECK(loop.now().name == "stiction");
  }
}

TEST_CASE("an incident continues after a restart", "[monitor][incident]") {
  Loop before;
  before.shows(kMinute, {K::stiction});
  Loop after;
  after.incident.restore(before.now());
  after.alarms.restore(K::stiction, before.alarms.alarm(K::stiction).memory());
  CHECK(after.incident.follow(3 * kMinute, after.alarms).empty());
  CHECK(after.now().opened_ms == kMinute);
  CHECK(after.shows(4 * kMinute, {K::stiction, K::backlash}).front().kind == Change::joined);
}

}  // namespace loop_incident_test
