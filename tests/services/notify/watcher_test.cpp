// SPDX-License-Identifier: Apache-2.0
#include "services/notify/watch/watcher.hpp"

#include <algorithm>

#include "tests/services/notify/notify_support.hpp"

namespace watcher_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;

TEST_CASE("a daemon that explains slowly answers all the same, and its alarms don't wait for it",
          "[notify][daemon]") {
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

}  // namespace watcher_test
