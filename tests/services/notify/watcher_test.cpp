// SPDX-License-Identifier: Apache-2.0
#include "services/notify/subscription/watcher.hpp"

#include <algorithm>
#include <map>

#include "tests/services/notify/notify_support.hpp"

namespace watcher_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;

TEST_CASE("slow explanations by the daemon don't delay its alarms", "[notify][daemon]") {
  const TemporaryFolder folder;
  FakeDaemon daemon(folder / "status.sock");
  Watcher watcher((folder / "status.sock").string());
  watcher.start();
  REQUIRE(eventually([&] { return watcher.error().empty(); }));
  daemon.explain_ms = 600;
  for (int i = 0; i < 20; ++i) daemon.set("FIC-" + std::to_string(i), "unacknowledged", true);
  std::chrono::milliseconds silent{0};
  std::optional<Snapshot> told;
  REQUIRE(eventually([&] {
    silent = std::max(silent, watcher.silent());
    if (auto newest = watcher.take()) told = std::move(newest);
    return told && told->alarms.size() == 20 && told->alarms.front().state == "unacknowledged";
  }));
  CHECK(silent.count() == 0);
  CHECK(watcher.error().empty());
  CHECK(daemon.explained > 0);
  CHECK(daemon.explained < 20);
  CHECK(watcher.stop_for(std::chrono::seconds(10)));
}

TEST_CASE("the explanation of an alarm stays valid until the daemon has a newer one",
          "[notify][daemon]") {
  const TemporaryFolder folder;
  FakeDaemon daemon(folder / "status.sock");
  daemon.set_explanation({{"alarm", "stiction"}, {"sentence", "The valve sticks."}});
  Watcher watcher((folder / "status.sock").string());
  watcher.start();
  std::map<AlarmKey, AlarmReading> alarms;
  const auto told = [&](auto is) {
    return eventually([&] {
      const auto newest = watcher.take();
      if (!newest) return false;
      alarms.clear();
      for (const AlarmReading& alarm : newest->alarms) alarms[alarm.key] = alarm;
      return is();
    });
  };
  const AlarmKey sticks{"FIC-101", "stiction"};
  daemon.set("FIC-101", "unacknowledged", true);
  REQUIRE(told([&] { return alarms[sticks].why == "The valve sticks."; }));

  daemon.explains = false;
  daemon.set("FIC-102", "unacknowledged", true);
  REQUIRE(told([&] { return alarms.contains({"FIC-102", "stiction"}); }));
  CHECK(alarms[sticks].why == "The valve sticks.");
  CHECK(alarms[{"FIC-102", "stiction"}].why.empty());

  daemon.set("FIC-101", "unacknowledged", true);
  REQUIRE(told([&] { return alarms[sticks].times_raised == 2; }));
  CHECK(alarms[sticks].why.empty());  // this new alarm has no explanation yet
  CHECK(watcher.stop_for(std::chrono::seconds(10)));
}

TEST_CASE("an alarm that joined an incident has the reason, as the alarm that opened it",
          "[notify]") {
  using loopwarden::protocol::Alarm;
  using loopwarden::protocol::Alarms;
  using loopwarden::protocol::Explained;
  Alarms all;
  all.alarms = {Alarm{.loop = "FIC-101", .alarm = "stiction", .raised_ms = 1'000},
                Alarm{.loop = "FIC-101", .alarm = "backlash", .raised_ms = 9'000}};
  all.incidents.emplace_back();
  all.incidents.back().id = "one";
  all.incidents.back().loop = "FIC-101";
  all.incidents.back().raised_s = 1.0;
  all.incidents.back().alarms = {"stiction", "backlash"};
  Explained told;
  told.alarm = all.alarms.back();
  told.explanation.emplace();
  told.explanation->raised_ms = 1'000;
  told.explanation->sentence = "The valve sticks.";
  CHECK(words_of(told, readings_of(all).back()).why == "The valve sticks.");

  // The explanation is of an earlier incident.
  all.incidents.back().raised_s = 5.0;
  CHECK(words_of(told, readings_of(all).back()).why.empty());
  all.incidents.clear();
  CHECK(words_of(told, readings_of(all).back()).why.empty());
}

}  // namespace watcher_test
