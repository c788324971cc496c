// SPDX-License-Identifier: Apache-2.0
#include "services/edge/store.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <map>
#include <utility>

#include "base/clock.hpp"

namespace loopwarden::edge {
namespace {

using sqlite::Statement;

constexpr const char* kTables = R"(
CREATE TABLE report(id INTEGER PRIMARY KEY AUTOINCREMENT, device TEXT NOT NULL,
                    payload BLOB NOT NULL);
CREATE TABLE kept(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
)";

// Bytes of a row in addition to its content: number, lengths, its share of the page.
constexpr std::uint64_t kRowBytes = 32;
constexpr int kMostUnreadable = 100;  // rows

std::uint64_t bytes_of(const std::string& device, std::size_t payload) {
  return device.size() + payload + kRowBytes;
}

constexpr sqlite::Schema kSchema{"store", 0x4C574531 /* "LWE1" */, 1, kTables};

sqlite::Database opened(const std::filesystem::path& file) {
  return sqlite::open_or_replace(
      file, base::utc_ms(),
      [&] {
        sqlite::Database database(file, sqlite::Access::write, std::chrono::seconds(1));
        database.adopt(kSchema, sqlite::Sync::normal);
        return database;
      },
      [&](const sqlite::Error& e, const std::filesystem::path& aside) {
        spdlog::error("{}: {}; moved to {}", file.string(), e.what(), aside.string());
      });
}

}  // namespace

Store::Store(const std::filesystem::path& file, std::uint64_t most_bytes)
    : database_(opened(file)), most_bytes_(most_bytes) {
  count();
}

void Store::count() {
  Statement read(database_,
                 "SELECT count(*), coalesce(sum(length(device) + length(payload)), 0) FROM report");
  read.step();
  waiting_ = static_cast<std::uint64_t>(read.integer(0));
  bytes_ = static_cast<std::uint64_t>(read.integer(1)) + kRowBytes * waiting_;
  dropped_ = static_cast<std::uint64_t>(kept("dropped").value_or(0));
}

void Store::append(const std::vector<Report>& reports) {
  try {
    sqlite::Transaction transaction(database_);
    Statement insert(database_, "INSERT INTO report(device, payload) VALUES(?, ?)");
    for (const Report& report : reports) {
      const std::string payload = sparkplug::encode(
          {.time_ms = {}, .seq = {}, .metrics = report.metrics}, sparkplug::Types::sent);
      insert.run(report.device, sqlite::Blob{payload});
      bytes_ += bytes_of(report.device, payload.size());
      ++waiting_;
    }
    drop_oldest();
    transaction.commit();
  } catch (...) {
    count();
    throw;
  }
}

void Store::drop_oldest() {
  if (bytes_ <= most_bytes_) return;
  std::int64_t last = 0;
  {
    Statement oldest(database_,
                     "SELECT id, length(device), length(payload) FROM report ORDER BY id");
    while (bytes_ > most_bytes_ && oldest.step()) {
      last = oldest.integer(0);
      bytes_ -= static_cast<std::uint64_t>(oldest.integer(1) + oldest.integer(2)) + kRowBytes;
      --waiting_;
      ++dropped_;
    }
  }
  Statement(database_, "DELETE FROM report WHERE id <= ?", last).run();
  keep("dropped", static_cast<std::int64_t>(dropped_));
}

std::vector<Store::Row> Store::read(std::int64_t after, std::size_t most) {
  std::vector<Row> rows;
  std::map<std::int64_t, std::string> unreadable;
  {
    Statement read(database_,
                   "SELECT id, device, payload FROM report WHERE id > ? ORDER BY id LIMIT ?", after,
                   most);
    while (read.step()) {
      Row row{.id = read.integer(0), .report = {.device = read.text(1), .metrics = {}}};
      try {
        row.report.metrics = sparkplug::decode(read.text(2)).metrics;
        rows.push_back(std::move(row));
      } catch (const sparkplug::BadPayload& e) {
        unreadable.emplace(row.id, e.what());
      }
    }
  }
  for (const auto& [id, why] : unreadable) set_aside(id, why);
  return rows;
}

// Moves an unreadable row away, so that it does not block all rows after it.
void Store::set_aside(std::int64_t id, const std::string& why) {
  sqlite::Transaction transaction(database_);
  database_.execute(
      "CREATE TABLE IF NOT EXISTS unreadable(id INTEGER PRIMARY KEY, device TEXT NOT NULL, payload "
      "BLOB NOT NULL)");
  Statement(database_, "INSERT OR REPLACE INTO unreadable SELECT * FROM report WHERE id = ?", id)
      .run();
  Statement(database_,
            "DELETE FROM unreadable WHERE id NOT IN (SELECT id FROM unreadable ORDER BY id DESC "
            "LIMIT ?)",
            kMostUnreadable)
      .run();
  Statement(database_, "DELETE FROM report WHERE id = ?", id).run();
  keep("dropped", static_cast<std::int64_t>(dropped_) + 1);
  transaction.commit();
  count();
  spdlog::error("store: row {} can't be read ({}): it is in table `unreadable` and is not sent", id,
                why);
}

void Store::remove_up_to(std::int64_t id) {
  {
    Statement gone(
        database_,
        "SELECT count(*), coalesce(sum(length(device) + length(payload)), 0) FROM report "
        "WHERE id <= ?",
        id);
    gone.step();
    const auto rows = static_cast<std::uint64_t>(gone.integer(0));
    waiting_ -= rows;
    bytes_ -= static_cast<std::uint64_t>(gone.integer(1)) + kRowBytes * rows;
  }
  Statement(database_, "DELETE FROM report WHERE id <= ?", id).run();
}

void Store::keep(const char* name, std::int64_t value) {
  Statement(database_, "INSERT OR REPLACE INTO kept VALUES(?, ?)", std::string(name), value).run();
}

std::optional<std::int64_t> Store::kept(const char* name) {
  Statement read(database_, "SELECT value FROM kept WHERE name = ?", std::string(name));
  return read.step() ? std::optional(read.integer(0)) : std::nullopt;
}

std::optional<std::uint8_t> Store::bd_seq() {
  const std::optional<std::int64_t> number = kept("bd_seq");
  return number ? std::optional(static_cast<std::uint8_t>(*number)) : std::nullopt;
}

void Store::keep_bd_seq(std::uint8_t bd_seq) { keep("bd_seq", bd_seq); }

}  // namespace loopwarden::edge
