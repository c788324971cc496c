// SPDX-License-Identifier: Apache-2.0
// Invariants of an alarm under any sequence of windows, operators and restarts.
#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>

#include "model/alarm/alarm.hpp"
#include "tests/support/property.hpp"

namespace alarm_property_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::tests::property;

namespace {

using S = AlarmState;

constexpr std::int64_t kMinute = 60'000;  // ms

enum class Event : std::uint8_t {
  on,
  off,
  not_valid,
  explain,
  acknowledge,
  reset,
  shelve,
  unshelve,
  time,
  restart
};
constexpr std::size_t kEvents = 10;

// The state of an alarm that is known without asking it.
struct Seen {
  std::int64_t now_ms = 1'800'000'000'000;
  bool on = false;
  std::uint32_t times_raised = 0;
  std::int64_t last_shelving_ms = 0;
};

bool latched(S state) {
  return state == S::latched_unacknowledged || state == S::latched_acknowledged;
}

// Returns true if an operator's action was taken.
bool apply(Alarm& alarm, Event event, Seen& seen) {
  switch (event) {
    case Event::on: {
      if (!seen.on) ++seen.times_raised;
      seen.on = true;
      // A severity that could not be computed must be replaced later.
      const bool computed = one_of(10) != 0;
      alarm.condition_on(seen.now_ms,
                         computed ? number(0.0, 100.0) : std::numeric_limits<double>::quiet_NaN());
      return true;
    }
    case Event::off:
      seen.on = false;
      alarm.condition_off(seen.now_ms);
      return true;
    case Event::not_valid: alarm.window_not_valid(); return true;
    case Event::explain: alarm.set_consequence(coin()); return true;
    case Event::acknowledge: return alarm.acknowledge(seen.now_ms);
    case Event::reset: return alarm.reset(seen.now_ms);
    case Event::shelve: {
      const std::int64_t until_ms = seen.now_ms + integer(-10, 600) * kMinute;
      const bool taken = alarm.shelve(seen.now_ms, until_ms);
      require(taken == (until_ms > seen.now_ms &&
                        until_ms - seen.now_ms <= alarm.settings().shelve_limit_ms),
              "put aside for a time within the limit, and no other");
      if (taken) seen.last_shelving_ms = seen.now_ms;
      return taken;
    }
    case Event::unshelve: return alarm.unshelve(seen.now_ms);
    case Event::time:
      // The clock is sometimes set back.
      seen.now_ms += integer(one_of(5) == 0 ? -1000 : 0, 1000) * kMinute;
      alarm.pass_time(seen.now_ms);
      return true;
    case Event::restart: {
      const Alarm before = alarm;
      alarm = Alarm(before.settings(), before.memory());
      if (before.window_valid() && seen.on) {
        alarm.condition_on(seen.now_ms, before.memory().severity_percent);
      } else if (before.window_valid()) {
        alarm.condition_off(seen.now_ms);
      }
      alarm.set_consequence(before.is_consequence());
      require(alarm.state() == before.state(), "a restart shows the same");
      return true;
    }
  }
  return false;
}

void check(const Alarm& alarm, const Seen& seen) {
  const AlarmMemory& memory = alarm.memory();
  require(alarm.active() == seen.on, "on as in the last window, whatever the operator did");
  require(memory.raised <= S::latched_acknowledged, "neither shelf nor suppression is a condition");
  require(alarm.settings().latching || !latched(memory.raised), "latched only if it latches");
  require(memory.times_raised == seen.times_raised, "each raising is counted once");
  require(memory.worst_severity_percent >= memory.severity_percent, "the worst is the worst");
  require(!(alarm.unacknowledged() && (alarm.shelved() || alarm.is_consequence())),
          "what is put aside or explained does not wait for the operator");
  require(alarm.shelved() == (alarm.state() == S::shelved), "a shelf is seen");
}

}  // namespace

TEST_CASE("no sequence of windows, actions and restarts breaks an alarm",
          "[monitor][alarm][property]") {
  for_all("any sequence", 2000, [] {
    Alarm alarm({.latching = coin(), .shelve_limit_ms = integer(1, 480) * kMinute});
    Seen seen;
    const std::int64_t steps = integer(0, 60);
    for (std::int64_t i = 0; i < steps; ++i) {
      const Alarm before = alarm;
      const auto event = static_cast<Event>(one_of(kEvents));
      const bool taken = apply(alarm, event, seen);
      check(alarm, seen);
      if (!taken) {
        require(alarm.memory() == before.memory() && alarm.state() == before.state(),
                "a refused action has no effect");
      }
      if (event == Event::off && before.unacknowledged()) {
        require(alarm.unacknowledged(), "what the operator has not seen does not go by itself");
      }
      if (event == Event::on && !before.active() && !alarm.shelved() && !alarm.is_consequence()) {
        require(alarm.state() == S::unacknowledged, "a new alarm waits for the operator");
      }
      if (event == Event::time && alarm.shelved()) {
        const std::int64_t left_ms = alarm.memory().shelved_until_ms - seen.now_ms;
        require(left_ms > 0 && left_ms <= alarm.settings().shelve_limit_ms,
                "no clock keeps an alarm on the shelf for longer than the limit");
      }
    }
  });
}

}  // namespace alarm_property_test
