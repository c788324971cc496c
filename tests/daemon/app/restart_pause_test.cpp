// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/restart_pause.hpp"

#include <catch2/catch.hpp>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::restart_pause_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::seconds;

TEST_CASE("the first starts have no pause; each further failure doubles it, up to a minute") {
  const tests::TemporaryFolder folder;
  const RestartPause starts(folder / "run" / "starts");
  seconds now{1000};
  for (int i = 0; i < 4; ++i) CHECK(starts.count_start(now += seconds(2), 1.0).count() == 0);
  CHECK(starts.count_start(now += seconds(2), 1.0) == seconds(2));
  CHECK(starts.count_start(now += seconds(2), 1.0) == seconds(4));
  for (int i = 0; i < 10; ++i) starts.count_start(now += seconds(60), 1.0);
  CHECK(starts.count_start(now += seconds(60), 1.0) == seconds(60));
}

TEST_CASE("a run of ten minutes, a requested end or a boot begin the count again") {
  const tests::TemporaryFolder folder;
  const RestartPause starts(folder / "starts");
  seconds now{1000};
  for (int i = 0; i < 5; ++i) starts.count_start(now, 1.0);
  SECTION("a long run") { now += minutes(10); }
  SECTION("a requested end") { starts.forget(); }
  SECTION("a boot, after which the clock is earlier") { now = seconds(5); }
  SECTION("an unreadable file") { tests::write_file(folder / "starts", "x"); }
  CHECK(starts.count_start(now, 1.0).count() == 0);
  for (int i = 0; i < 3; ++i) CHECK(starts.count_start(now, 1.0).count() == 0);
  CHECK(starts.count_start(now, 1.0) == seconds(2));
}

TEST_CASE("without a place for the count the daemon starts without a pause") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "file", "x");
  const RestartPause starts(folder / "file" / "starts");
  for (int i = 0; i < 9; ++i) CHECK(starts.count_start(seconds(1), 1.0).count() == 0);
}

}  // namespace
}  // namespace loopwarden::daemon::restart_pause_test
