// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/repeated_refusals.hpp"

#include <catch2/catch.hpp>

#include <chrono>
#include <string>

#include "daemon/journal/journal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::journal::repeated_refusals_test {
namespace {

JournalEntry refused(const std::string& value, std::int64_t utc_ms,
                     const std::string& peer = "10.0.0.7:4000") {
  JournalEntry line;
  line.kind = JournalEntry::Kind::register_write;
  line.utc_ms = utc_ms;
  line.loop = "FIC-101";
  line.peer = peer;
  line.what = "sp";
  line.new_value = value;
  line.result = "refused: in manual the set point follows PV";
  return line;
}

}  // namespace

TEST_CASE("a refusal that a master repeats each second is one line per value", "[journal]") {
  RepeatedRefusals refusals;
  std::int64_t now_ms = 1'800'000'000'000;
  int lines = 0;
  const auto write = [&](const std::string& value) {
    now_ms += 1000;
    // Another port is not another peer.
    if (!refusals.repeats(refused(value, now_ms, "10.0.0.7:" + std::to_string(now_ms % 60'000)))) {
      ++lines;
    }
  };
  for (int second = 0; second < 3600; ++second) write("60");
  CHECK(lines == 1);
  for (int second = 0; second < 100; ++second) write("61");
  CHECK(lines == 2);
  write("60");
  CHECK(lines == 3);
}

TEST_CASE("a refusal is written again after a pause, for another peer, loop or reason",
          "[journal]") {
  RepeatedRefusals refusals;
  const std::int64_t now_ms = 1'800'000'000'000;
  CHECK_FALSE(refusals.repeats(refused("60", now_ms)));
  CHECK(refusals.repeats(refused("60", now_ms + 29'999)));
  CHECK_FALSE(refusals.repeats(refused("60", now_ms + 60'000)));
  CHECK_FALSE(refusals.repeats(refused("60", now_ms)));  // the clock was set back
  CHECK_FALSE(refusals.repeats(refused("60", now_ms, "anna@10.0.0.5 by page (uid 997)")));
  JournalEntry other = refused("60", now_ms);
  other.loop = "FIC-102";
  CHECK_FALSE(refusals.repeats(other));
  other = refused("60", now_ms);
  other.result = "refused: too many commands at once";
  CHECK_FALSE(refusals.repeats(other));
  JournalEntry done = refused("60", now_ms);
  done.result = "done";
  CHECK_FALSE(refusals.repeats(done));
  CHECK_FALSE(refusals.repeats(done));
  CHECK_FALSE(refusals.repeats(refused("60", now_ms)));
}

TEST_CASE("the journal keeps one line of a repeated refusal", "[journal]") {
  const tests::TemporaryFolder folder;
  Journal journal({.folder = folder.path()});
  journal.open();
  journal.start();
  std::uint64_t ticket = 0;
  for (int i = 0; i < 100; ++i) ticket = journal.post(refused("60", 1'800'000'000'000 + 1000 * i));
  CHECK(ticket == 1);
  CHECK(journal.wait_written(ticket, std::chrono::seconds(20)));
  CHECK(journal.newest(10).size() == 1);
}

}  // namespace loopwarden::daemon::journal::repeated_refusals_test
