// SPDX-License-Identifier: Apache-2.0
#include "services/database/connection.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/postgres.hpp"
#include "tests/support/temporary_folder.hpp"

namespace connection_test {

using namespace loopwarden;

std::string trouble(const fleet::DatabaseSettings& settings) {
  try {
    fleet::open_database(settings);
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

TEST_CASE("libpq's error about an unreadable URL contains no password", "[database]") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "password", "gar-nicht%geheim\n");
  const std::string text =
      trouble({"postgresql://u@[::1x/d", {.credential = {}, .file = folder / "password"}});
  CHECK_FALSE(text.empty());
  CHECK(text.find("geheim") == std::string::npos);
  CHECK_THAT(trouble({"postgresql://u@h/d", {.credential = {}, .file = folder / "none"}}),
             Catch::Contains("none: can't be read"));
}

TEST_CASE("a connection is read-only or writable as opened", "[database]") {
  if (tests::Postgres::programs().empty()) {
    WARN("left out: postgresql is not installed (tools/debian-packages.txt)");
    return;
  }
  const tests::Postgres database;
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "password", "any&thing=?/%\n");
  const auto reader =
      fleet::open_database({database.url(), {.credential = {}, .file = folder / "password"}},
                           {.program = "reader", .statement_seconds = 1, .read_only = true});
  const auto ask = [](pqxx::connection& connection, const std::string& sql) {
    return pqxx::nontransaction(connection).exec1(sql)[0].as<std::string>();
  };
  CHECK(ask(*reader, "SHOW application_name") == "reader");
  CHECK(ask(*reader, "SHOW statement_timeout") == "1s");
  CHECK(ask(*reader, "SHOW TIME ZONE") == "UTC");
  CHECK_THROWS_AS(ask(*reader, "SELECT pg_sleep(30)"), pqxx::sql_error);
  CHECK_THROWS_WITH(pqxx::nontransaction(*reader).exec("CREATE TABLE t(n integer)"),
                    Catch::Contains("read-only"));
  const auto host = fleet::open_database({database.url(), {}});
  CHECK(ask(*host, "SHOW application_name") == "loopwarden-fleet");
  CHECK_NOTHROW(pqxx::nontransaction(*host).exec("CREATE TABLE t(n integer)"));
}

}  // namespace connection_test
