// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/journal.hpp"

#include <signal.h>
#include <sqlite3.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "tests/support/device/foreign_process.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::journal::journal_test {
namespace {

using alarm::AlarmMemory;
using alarm::AlarmState;
using Kind = JournalEntry::Kind;

constexpr std::chrono::milliseconds kPatience{20'000};

JournalSettings settings_in(const tests::TemporaryFolder& folder) {
  JournalSettings settings;
  settings.folder = folder.path();
  settings.retry = std::chrono::milliseconds(10);
  return settings;
}

AlarmMemory remembered(AlarmState state, std::uint32_t times = 1) {
  AlarmMemory memory;
  memory.raised = state;
  memory.raised_ms = 1'800'000'000'000;
  memory.times_raised = times;
  memory.severity_percent = 6.25;
  return memory;
}

JournalEntry transition(const std::string& loop, AlarmState to, std::uint32_t times = 1) {
  JournalEntry entry;
  entry.kind = Kind::alarm;
  entry.utc_ms = 1'800'000'000'123;
  entry.loop = loop;
  entry.alarm = "stiction";
  entry.from = "normal";
  entry.to = alarm::to_text(to);
  entry.severity_percent = 6.25;
  entry.memory = remembered(to, times);
  return entry;
}

void sql(const std::filesystem::path& file, const char* text) {
  sqlite3* db = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &db) == SQLITE_OK);
  const int result = sqlite3_exec(db, text, nullptr, nullptr, nullptr);
  sqlite3_close(db);
  REQUIRE(result == SQLITE_OK);
}

}  // namespace

TEST_CASE("a line is read back as it was posted", "[journal]") {
  const tests::TemporaryFolder folder;
  Journal journal(settings_in(folder));
  CHECK(journal.open().memories.empty());
  journal.start();
  JournalEntry write;
  write.kind = Kind::register_write;
  write.utc_ms = 1'800'000'000'456;
  write.loop = "FIC-'101\"; DROP TABLE journal;--";
  write.peer = "192.168.1.5:40312";
  write.what = "set_point";
  write.old_value = "5";
  write.new_value = "5.5";
  write.result = "done";
  journal.post(transition("FIC-101", AlarmState::unacknowledged));
  REQUIRE(journal.wait_written(journal.post(write), kPatience));

  const std::vector<JournalRow> rows = journal.newest(10);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].id > rows[1].id);
  CHECK(rows[0].entry.kind == Kind::register_write);
  CHECK(rows[0].entry.utc_ms == write.utc_ms);
  CHECK(rows[0].entry.loop == write.loop);
  CHECK(rows[0].entry.peer == write.peer);
  CHECK(rows[0].entry.what == write.what);
  CHECK(rows[0].entry.old_value == "5");
  CHECK(rows[0].entry.new_value == "5.5");
  CHECK(rows[0].entry.result == "done");
  CHECK_FALSE(rows[0].entry.severity_percent);
  CHECK(rows[1].entry.kind == Kind::alarm);
  CHECK(rows[1].entry.from == "normal");
  CHECK(rows[1].entry.to == "unacknowledged");
  CHECK(rows[1].entry.severity_percent == 6.25);
  CHECK(journal.newest(10, "FIC-101").size() == 1);
  CHECK(journal.newest(1).size() == 1);
  CHECK(journal.status().written == 2);
  CHECK(journal.status().error.empty());
}

TEST_CASE("lines are searched only by their content", "[journal]") {
  const tests::TemporaryFolder folder;
  Journal journal(settings_in(folder));
  journal.open();
  journal.start();
  std::uint64_t ticket = 0;
  for (int i = 0; i < 10; ++i) {
    JournalEntry line;
    line.kind = i % 2 == 0 ? Kind::operator_action : Kind::register_write;
    line.utc_ms = 1000 + i;
    line.loop = i < 5 ? "FIC-101" : "FIC-102";
    line.peer = "Anna@10.0.0.5 by page (uid 997)";
    line.what = "set point";
    line.new_value = std::to_string(i);
    line.reason = i == 3 ? "100 % sure_" : "";
    ticket = journal.post(line);
  }
  REQUIRE(journal.wait_written(ticket, kPatience));
  const auto ids = [&](const JournalQuery& query) {
    std::vector<std::int64_t> found;
    for (const JournalRow& row : journal.search(query)) found.push_back(row.id);
    return found;
  };
  using Ids = std::vector<std::int64_t>;
  CHECK(ids({.most = 3}) == Ids{10, 9, 8});
  CHECK(ids({.most = 3, .before_id = 8}) == Ids{7, 6, 5});
  CHECK(ids({.loop = "FIC-101", .kind = Kind::register_write}) == Ids{4, 2});
  CHECK(ids({.from_ms = 1007, .to_ms = 1008}) == Ids{9, 8});
  CHECK(ids({.most = 2, .text = "aNNa"}) == Ids{10, 9});
  // Characters with a meaning in SQL are text here.
  CHECK(ids({.text = "% SURE_"}) == Ids{4});
  CHECK(ids({.text = "%"}) == Ids{4});
  CHECK(ids({.text = "100_%"}).empty());
  CHECK(ids({.text = "' OR '1'='1"}).empty());
  CHECK(ids({.loop = "FIC-101' OR 1=1 --"}).empty());
  // A search does not match across the borders of fields.
  CHECK(ids({.text = "point3"}).empty());
  CHECK(ids({.most = 0}).empty());
}

TEST_CASE("raised alarms are found by their time, also in a journal older than the index",
          "[journal]") {
  const tests::TemporaryFolder folder;
  const auto post = [](Journal& journal, std::int64_t utc_ms, const std::string& from,
                       const std::string& to) {
    JournalEntry line;
    line.kind = Kind::alarm;
    line.utc_ms = utc_ms;
    line.loop = "FIC-101";
    line.alarm = "bad_pv";
    line.from = from;
    line.to = to;
    return journal.post(line);
  };
  {
    Journal journal(settings_in(folder));
    journal.open();
    journal.start();
    post(journal, 1000, "normal", "unacknowledged");
    post(journal, 2000, "unacknowledged", "acknowledged");
    post(journal, 3000, "shelved", "unacknowledged");
    post(journal, 3500, "acknowledged", "unacknowledged");
    post(journal, 3600, "unacknowledged", "unacknowledged");
    // The clock was set back.
    post(journal, 900, "suppressed", "unacknowledged");
    JournalEntry order;
    order.kind = Kind::operator_action;
    order.utc_ms = 1500;
    REQUIRE(journal.wait_written(journal.post(order), kPatience));
  }
  sqlite::Database(folder / "journal.sqlite", sqlite::Access::write, std::chrono::seconds(1))
      .execute("DROP INDEX journal_came");
  Journal journal(settings_in(folder));
  journal.open();
  journal.start();
  REQUIRE(journal.wait_written(post(journal, 4000, "returned_unacknowledged", "unacknowledged"),
                               kPatience));
  const auto times = [&](std::int64_t from_ms, std::int64_t to_ms, std::size_t most) {
    std::vector<std::int64_t> found;
    for (const auto& one : journal.came(from_ms, to_ms, most)) {
      CHECK((one.source == "FIC-101" && one.alarm == "bad_pv"));
      found.push_back(one.utc_ms);
    }
    return found;
  };
  using Times = std::vector<std::int64_t>;
  CHECK(times(0, 5000, 10) == Times{4000, 1000, 900});
  CHECK(times(0, 5000, 2) == Times{4000, 1000});
  CHECK(times(900, 4000, 10) == Times{1000, 900});
  CHECK(times(901, 4001, 10) == Times{4000, 1000});
  const sqlite::Database file(journal.path(), sqlite::Access::read, std::chrono::seconds(1));
  sqlite::Statement index(file, "SELECT 1 FROM sqlite_master WHERE name = 'journal_came'");
  CHECK(index.step());
}

TEST_CASE("lines can't be changed, and the oldest are deleted beyond the limit", "[journal]") {
  const tests::TemporaryFolder folder;
  JournalSettings settings = settings_in(folder);
  settings.most_rows = 5;
  Journal journal(settings);
  journal.open();
  journal.start();
  for (int i = 0; i < 12; ++i) {
    REQUIRE(journal.wait_written(journal.post(transition("FIC-101", AlarmState::acknowledged)),
                                 kPatience));
  }
  const auto rows = journal.newest(100);
  REQUIRE(rows.size() == 5);
  CHECK(rows.front().id == 12);
  sqlite3* db = nullptr;
  REQUIRE(sqlite3_open(journal.path().c_str(), &db) == SQLITE_OK);
  CHECK(sqlite3_exec(db, "UPDATE journal SET peer = 'nobody'", nullptr, nullptr, nullptr) !=
        SQLITE_OK);
  sqlite3_close(db);
}

TEST_CASE("the memory of the alarms survives a restart", "[journal]") {
  const tests::TemporaryFolder folder;
  {
    Journal journal(settings_in(folder));
    journal.open();
    journal.start();
    journal.post(transition("FIC-101", AlarmState::unacknowledged));
    journal.post(transition("FIC-102", AlarmState::unacknowledged));
    journal.post(transition("FIC-101", AlarmState::acknowledged, 3));
  }  // stop() writes the waiting lines
  Journal journal(settings_in(folder));
  const AlarmStates states = journal.open();
  REQUIRE(states.memories.size() == 2);
  CHECK(states.memories.at({"FIC-101", "stiction"}) == remembered(AlarmState::acknowledged, 3));
  CHECK(states.memories.at({"FIC-102", "stiction"}) == remembered(AlarmState::unacknowledged));
}

TEST_CASE("after a kill at any moment, each line that was confirmed is kept", "[journal]") {
  const tests::TemporaryFolder folder;
  for (int round = 0; round < 5; ++round) {
    std::array<int, 2> done{};
    REQUIRE(::pipe(done.data()) == 0);
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      Journal journal(settings_in(folder));
      journal.open();
      journal.start();
      for (std::uint32_t i = 1;; ++i) {
        journal.wait_written(journal.post(transition("FIC-101", AlarmState::acknowledged, i)),
                             kPatience);
        if (::write(done[1], &i, sizeof i) != static_cast<ssize_t>(sizeof i)) ::_exit(1);
      }
    }
    ::close(done[1]);
    std::uint32_t told = 0;
    // Each round kills at another moment of the writing.
    for (int i = 0; i < 3 + 5 * round; ++i) {
      REQUIRE(::read(done[0], &told, sizeof told) == static_cast<ssize_t>(sizeof told));
    }
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (::read(done[0], &told, sizeof told) == static_cast<ssize_t>(sizeof told)) {
    }
    ::close(done[0]);
    Journal journal(settings_in(folder));
    const AlarmStates states = journal.open();
    CHECK(states.memories.at({"FIC-101", "stiction"}).times_raised >= told);
    CHECK(journal.status().damaged == 0);
  }
}

TEST_CASE("a damaged file is moved aside, and the alarms keep their memory", "[journal]") {
  const tests::TemporaryFolder folder;
  const std::filesystem::path file = folder / "journal.sqlite";
  {
    Journal journal(settings_in(folder));
    journal.open();
    journal.start();
    journal.post(transition("FIC-101", AlarmState::acknowledged));
  }
  SECTION("overwritten") { tests::write_file(file, std::string(10'000, 'x')); }
  SECTION("cut short") { std::filesystem::resize_file(file, 5000); }
  SECTION("tables of another program") {
    std::filesystem::remove(file);
    sql(file, "CREATE TABLE recipes(name TEXT)");
  }
  SECTION("a table is missing") { sql(file, "DROP TABLE alarm_state"); }
  Journal journal(settings_in(folder));
  const AlarmStates states = journal.open();
  CHECK(states.memories.at({"FIC-101", "stiction"}) == remembered(AlarmState::acknowledged));
  CHECK(journal.status().damaged == 1);
  journal.start();
  REQUIRE(journal.wait_written(journal.post(transition("FIC-102", AlarmState::unacknowledged)),
                               kPatience));
  bool told = false;
  for (const JournalRow& row : journal.newest(10)) {
    told = told || (row.entry.what == "journal replaced" && !row.entry.result.empty());
  }
  CHECK(told);
  bool kept = false;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    kept = kept || entry.path().string().find(".damaged-") != std::string::npos;
  }
  CHECK(kept);
  journal.stop();
  Journal again(settings_in(folder));
  CHECK(again.open().memories.size() == 2);
  CHECK(again.status().damaged == 0);
}

TEST_CASE("a journal of a later version is not changed; lines wait in memory, with the reason",
          "[journal]") {
  const tests::TemporaryFolder folder;
  const std::filesystem::path file = folder / "journal.sqlite";
  {
    Journal journal(settings_in(folder));
    journal.open();
    journal.start();
    journal.post(transition("FIC-101", AlarmState::acknowledged));
  }
  sql(file, "PRAGMA user_version=7");
  const std::string before = tests::read_file(file);
  Journal journal(settings_in(folder));
  CHECK(journal.open().memories.at({"FIC-101", "stiction"}).raised == AlarmState::acknowledged);
  journal.start();
  CHECK_FALSE(journal.wait_written(journal.post(transition("FIC-102", AlarmState::unacknowledged)),
                                   kPatience));
  CHECK_THAT(journal.status().error,
             Catch::Contains("journal of version 7, this program knows version 1"));
  CHECK(journal.status().damaged == 0);
  CHECK(journal.newest(10).empty());
  CHECK(tests::read_file(file) == before);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    CHECK(entry.path().string().find(".damaged-") == std::string::npos);
  }
  // Moved away manually: a new journal begins, with the waiting lines.
  std::filesystem::rename(file, folder / "kept");
  REQUIRE(test::eventually([&] { return journal.status().waiting == 0; }));
  CHECK(journal.newest(10).size() == 1);
  CHECK(journal.status().error.empty());
}

TEST_CASE("if only the copy is damaged, the journal is enough", "[journal]") {
  const tests::TemporaryFolder folder;
  {
    Journal journal(settings_in(folder));
    journal.open();
    journal.start();
    journal.post(transition("FIC-101", AlarmState::acknowledged));
  }
  const std::filesystem::path copy = folder / "alarm-state.json";
  std::string text = tests::read_file(copy);
  SECTION("a digit changed") { text[text.find("6.25")] = '7'; }
  SECTION("cut short") { text.resize(text.size() / 2); }
  SECTION("empty") { text.clear(); }
  tests::write_file(copy, text);
  std::string why;
  CHECK_FALSE(AlarmStateFile(copy).load(why));
  CHECK(why.find("damaged") != std::string::npos);
  Journal journal(settings_in(folder));
  CHECK(journal.open().memories.at({"FIC-101", "stiction"}).raised == AlarmState::acknowledged);
}

TEST_CASE("a disk that refuses: lines wait, are counted, and are written when there is room",
          "[journal]") {
  const tests::TemporaryFolder folder;
  JournalSettings settings = settings_in(folder);
  settings.most_waiting = 50;
  Journal journal(settings);
  journal.open();
  journal.start();
  REQUIRE(journal.wait_written(journal.post(transition("FIC-101", AlarmState::unacknowledged)),
                               kPatience));
  {
    const tests::FileSizeLimit full(4096);
    const std::uint64_t ticket = journal.post(transition("FIC-101", AlarmState::acknowledged));
    CHECK_FALSE(journal.wait_written(ticket, kPatience));
    CHECK(journal.status().waiting == 1);
    CHECK_FALSE(journal.status().error.empty());
    for (int i = 0; i < 60; ++i) journal.post(transition("FIC-102", AlarmState::unacknowledged));
    CHECK(test::eventually([&] { return journal.status().lost == 11; }));
  }
  REQUIRE(test::eventually([&] { return journal.status().waiting == 0; }));
  CHECK(journal.status().error.empty());
  CHECK(journal.status().written == 51);
  journal.stop();
  // The line of the acknowledgement found no room, but its effect was kept.
  Journal again(settings);
  CHECK(again.open().memories.at({"FIC-101", "stiction"}).raised == AlarmState::acknowledged);
}

TEST_CASE("a folder that can't be written: the journal reports it and continues", "[journal]") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "file", "in the way");
  JournalSettings settings = settings_in(folder);
  settings.folder = folder / "file";
  Journal journal(settings);
  CHECK(journal.open().memories.empty());
  CHECK_FALSE(journal.status().error.empty());
  journal.start();
  CHECK_FALSE(journal.wait_written(journal.post(transition("FIC-101", AlarmState::acknowledged)),
                                   kPatience));
  CHECK(journal.newest(5).empty());
}

}  // namespace loopwarden::daemon::journal::journal_test
