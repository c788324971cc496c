// SPDX-License-Identifier: Apache-2.0
#include "base/sqlite/sqlite.hpp"

#include <catch2/catch.hpp>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include "tests/support/file_size_limit.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::sqlite_test {

using namespace std::chrono_literals;
using sqlite::Access;
using sqlite::Database;
using sqlite::Error;
using sqlite::Statement;
using sqlite::Transaction;

constexpr sqlite::Schema kSchema{"test", 0x4C575431, 1,
                                 "CREATE TABLE t(n INTEGER, r REAL, s TEXT, b BLOB);"};

Database opened(const std::filesystem::path& file, const sqlite::Schema& schema = kSchema) {
  Database database(file, Access::write, 100ms);
  database.adopt(schema, sqlite::Sync::full);
  return database;
}

std::int64_t rows(const Database& database) {
  Statement count(database, "SELECT count(*) FROM t");
  count.step();
  return count.integer(0);
}

bool is_damaged(const std::filesystem::path& file, const sqlite::Schema& schema = kSchema) {
  try {
    opened(file, schema);
  } catch (const Error& e) {
    return e.damaged();
  }
  FAIL("no error");
  return false;
}

TEST_CASE("values bound to a statement are read back unchanged") {
  const tests::TemporaryFolder folder;
  const Database database = opened(folder / "f");
  const std::string bytes("\0\xFF x", 4);
  Statement insert(database, "INSERT INTO t VALUES(?, ?, ?, ?)");
  insert.run(std::numeric_limits<std::int64_t>::min(), 0.1, std::string("\u00e4"),
             sqlite::Blob{bytes});
  insert.run(true, std::optional<double>(), std::optional<std::string>(), std::nullopt);
  CHECK(database.last_row() == 2);
  Statement read(database, "SELECT * FROM t WHERE n <= ? ORDER BY rowid", 1U);
  REQUIRE(read.step());
  CHECK(read.integer(0) == std::numeric_limits<std::int64_t>::min());
  CHECK(read.number(1) == 0.1);
  CHECK(read.text(2) == "\u00e4");
  CHECK(read.text(3) == bytes);
  REQUIRE(read.step());
  CHECK(read.integer(0) == 1);
  CHECK(read.number_or_null(1) == std::nullopt);
  CHECK(read.is_null(2));
  CHECK(read.text(3).empty());
  CHECK_FALSE(read.step());
}

TEST_CASE("a transaction that is not committed has no effect") {
  const tests::TemporaryFolder folder;
  Database database = opened(folder / "f");
  {
    Transaction transaction(database);
    Statement(database, "INSERT INTO t(n) VALUES(1)").run();
  }
  CHECK(rows(database) == 0);
  Transaction transaction(database);
  Statement(database, "INSERT INTO t(n) VALUES(1)").run();
  transaction.commit();
  CHECK(rows(database) == 1);
}

TEST_CASE("foreign files and rubbish count as damaged; a missing folder and a full disk do not") {
  const tests::TemporaryFolder folder;
  opened(folder / "f");
  CHECK_NOTHROW(opened(folder / "f"));
  CHECK(is_damaged(folder / "f", {"other", 0x4C575432, 1, kSchema.tables}));
  Database(folder / "g", Access::write, 100ms).execute("CREATE TABLE x(n)");
  CHECK(is_damaged(folder / "g"));
  tests::write_file(folder / "h", std::string(10'000, 'x'));
  CHECK(is_damaged(folder / "h"));
  CHECK_FALSE(is_damaged(folder / "none/f"));
  const tests::FileSizeLimit full(0);
  CHECK_FALSE(is_damaged(folder / "i"));
}

TEST_CASE(
    "a file of another version is refused with its version and the remedy, and is not changed") {
  const tests::TemporaryFolder folder;
  const int version = GENERATE(2, 9);
  const sqlite::Schema other{"test", kSchema.application_id, version, kSchema.tables};
  // The program was killed while it wrote. The log contains rows that the file lacks.
  const std::filesystem::path file = folder / "f";
  {
    const Database writer = opened(folder / "written", other);
    Statement(writer, "INSERT INTO t(n) VALUES(1)").run();
    for (const std::string end : {"", "-wal"}) {
      std::filesystem::copy_file((folder / "written").string() + end, file.string() + end);
    }
  }
  const std::string before = tests::read_file(file);
  const std::string log = tests::read_file(file.string() + "-wal");
  REQUIRE_FALSE(log.empty());
  const auto refused = [&](auto open) {
    try {
      open();
    } catch (const Error& e) {
      CHECK(e.other_version());
      CHECK_FALSE(e.damaged());
      CHECK_THAT(e.what(),
                 Catch::Contains(file.string() + " is a test of version " +
                                 std::to_string(version) + ", this program knows version 1") &&
                     Catch::Contains("move the file away"));
      return;
    }
    FAIL("no error");
  };
  refused([&] { opened(file); });
  refused([&] { Database(file, Access::read, 100ms).demand_schema(kSchema); });
  CHECK(tests::read_file(file) == before);
  CHECK(tests::read_file(file.string() + "-wal") == log);
  CHECK(rows(opened(file, other)) == 1);
}

TEST_CASE("a reader sees the rows of another connection, and can't write") {
  const tests::TemporaryFolder folder;
  Database writer = opened(folder / "f");
  Statement(writer, "INSERT INTO t(n) VALUES(1)").run();
  Database reader(folder / "f", Access::read, 100ms);
  CHECK(rows(reader) == 1);
  CHECK_THROWS_AS(reader.execute("INSERT INTO t(n) VALUES(2)"), Error);
  CHECK_THROWS_AS(Database(folder / "none", Access::read, 100ms), Error);
}

TEST_CASE("a database that is moved aside takes its log along") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "f", "x");
  tests::write_file(folder / "f-wal", "y");
  const auto aside = sqlite::move_aside(folder / "f", 7);
  CHECK(aside == folder / "f.damaged-7");
  CHECK(tests::read_file(folder / "f.damaged-7-wal") == "y");
  CHECK_FALSE(std::filesystem::exists(folder / "f"));
  CHECK_FALSE(std::filesystem::exists(folder / "f-wal"));
}

TEST_CASE("a damaged database is replaced, one of another version is not") {
  const tests::TemporaryFolder folder;
  std::vector<std::filesystem::path> moved;
  const auto open_f = [&](int version) {
    return sqlite::open_or_replace(
        folder / "f", 7,
        [&] {
          Database database(folder / "f", Access::write, 100ms);
          database.adopt({"test", 5, version, "CREATE TABLE t(n)"}, sqlite::Sync::normal);
          return database;
        },
        [&](const Error&, const std::filesystem::path& aside) { moved.push_back(aside); });
  };
  tests::write_file(folder / "f", std::string(4096, 'x'));
  Database replaced = open_f(1);
  Statement(replaced, "INSERT INTO t(n) VALUES(1)").run();
  CHECK(moved == std::vector<std::filesystem::path>{folder / "f.damaged-7"});
  CHECK(tests::read_file(folder / "f.damaged-7") == std::string(4096, 'x'));
  Database again = open_f(1);
  CHECK(rows(again) == 1);
  CHECK_THROWS_AS(open_f(2), Error);
  CHECK(moved.size() == 1);
}

}  // namespace loopwarden::sqlite_test
