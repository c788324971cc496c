// SPDX-License-Identifier: Apache-2.0
#include "fleet/edge/store.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include <chrono>
#include <system_error>
#include <utility>

namespace loopwarden::edge {
namespace {

constexpr int kSchemaVersion = 1;
constexpr int kApplicationId = 0x4C574531;  // "LWE1"

constexpr const char* kTables = R"(
CREATE TABLE report(id INTEGER PRIMARY KEY AUTOINCREMENT, device TEXT NOT NULL, payload BLOB NOT NULL);
CREATE TABLE kept(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
)";

// What a row costs beside its bytes: number, lengths, its share of the page.
constexpr std::uint64_t kRowBytes = 32;

std::uint64_t bytes_of(const std::string& device, std::size_t payload) {
  return device.size() + payload + kRowBytes;
}

}  // namespace

// A prepared statement that finalises itself.
class Store::Statement {
 public:
  Statement(Store& store, const char* sql) : store_(store) {
    if (sqlite3_prepare_v2(store.db_, sql, -1, &statement_, nullptr) != SQLITE_OK)
      store.fail("prepare");
  }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }

  Statement& bind(int column, std::int64_t number) {
    if (sqlite3_bind_int64(statement_, column, number) != SQLITE_OK) store_.fail("bind");
    return *this;
  }
  Statement& bind(int column, const std::string& text) {
    const int size = static_cast<int>(text.size());
    if (sqlite3_bind_text(statement_, column, text.data(), size, SQLITE_TRANSIENT) != SQLITE_OK) {
      store_.fail("bind");
    }
    return *this;
  }
  Statement& bind_bytes(int column, const std::string& bytes) {
    const int size = static_cast<int>(bytes.size());
    if (sqlite3_bind_blob(statement_, column, bytes.data(), size, SQLITE_TRANSIENT) != SQLITE_OK) {
      store_.fail("bind");
    }
    return *this;
  }
  // True while there are rows.
  bool step() {
    const int result = sqlite3_step(statement_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) store_.fail("step");
    return result == SQLITE_ROW;
  }
  void run_once() {
    step();
    sqlite3_reset(statement_);
  }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
  std::string bytes(int column) const {
    const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    return data == nullptr ? std::string()
                           : std::string(data, data + sqlite3_column_bytes(statement_, column));
  }

 private:
  Store& store_;
  sqlite3_stmt* statement_ = nullptr;
};

Store::Store(std::filesystem::path file, std::uint64_t most_bytes)
    : file_(std::move(file)), most_bytes_(most_bytes) {
  // The destructor does not run for a constructor that throws.
  try {
    try {
      open();
    } catch (const StoreError& e) {
      if (e.kind() != StoreError::Kind::damaged) throw;
      move_aside(e.what());
      open();
    }
    count();
  } catch (...) {
    sqlite3_close(db_);
    throw;
  }
}

Store::~Store() { sqlite3_close(db_); }

void Store::open() {
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  if (sqlite3_open_v2(file_.c_str(), &db_, flags, nullptr) != SQLITE_OK) fail("open");
  sqlite3_busy_timeout(db_, 1000);  // ms, for a backup that holds it
  execute("PRAGMA journal_mode=WAL");
  execute("PRAGMA synchronous=NORMAL");
  execute("PRAGMA journal_size_limit=1048576");
  check();
}

void Store::move_aside(const char* why) {
  sqlite3_close(std::exchange(db_, nullptr));
  const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::system_clock::now().time_since_epoch());
  const std::string aside = fmt::format("{}.damaged-{}", file_.string(), now.count());
  spdlog::error("{}: {}; moved to {}", file_.string(), why, aside);
  std::error_code failed;
  std::filesystem::rename(file_, aside, failed);
  if (failed) throw StoreError(StoreError::Kind::unavailable, failed.message());
  // A log left behind would be played into the new database.
  for (const char* belongs : {"-wal", "-shm"}) {
    std::filesystem::remove(file_.string() + belongs, failed);
  }
}

void Store::check() {
  std::int64_t version = 0;
  std::int64_t application = 0;
  bool empty = false;
  {
    Statement read(*this, "PRAGMA user_version");
    if (read.step()) version = read.integer(0);
    Statement id(*this, "PRAGMA application_id");
    if (id.step()) application = id.integer(0);
    Statement any(*this, "SELECT 1 FROM sqlite_master LIMIT 1");
    empty = !any.step();
  }
  if (empty) {
    execute("BEGIN IMMEDIATE");
    execute(kTables);
    execute(fmt::format("PRAGMA application_id={}", kApplicationId).c_str());
    execute(fmt::format("PRAGMA user_version={}", kSchemaVersion).c_str());
    execute("COMMIT");
    return;
  }
  if (application != kApplicationId || version != kSchemaVersion) {
    throw StoreError(StoreError::Kind::damaged, "it is no store of this version");
  }
  Statement quick(*this, "PRAGMA quick_check(1)");
  if (!quick.step() || quick.bytes(0) != "ok")
    throw StoreError(StoreError::Kind::damaged, "it is damaged");
}

void Store::count() {
  Statement read(*this,
                 "SELECT count(*), coalesce(sum(length(device) + length(payload)), 0) FROM report");
  read.step();
  waiting_ = static_cast<std::uint64_t>(read.integer(0));
  bytes_ = static_cast<std::uint64_t>(read.integer(1)) + kRowBytes * waiting_;
  dropped_ = static_cast<std::uint64_t>(kept("dropped").value_or(0));
}

void Store::execute(const char* sql) {
  if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail("execute");
}

void Store::fail(const char* step) const {
  const int code = sqlite3_errcode(db_) & 0xFF;
  const bool damaged = code == SQLITE_CORRUPT || code == SQLITE_NOTADB;
  throw StoreError(damaged ? StoreError::Kind::damaged : StoreError::Kind::unavailable,
                   fmt::format("{}: {}", step, sqlite3_errmsg(db_)));
}

void Store::append(const std::vector<Report>& reports) {
  execute("BEGIN IMMEDIATE");
  try {
    Statement insert(*this, "INSERT INTO report(device, payload) VALUES(?, ?)");
    for (const Report& report : reports) {
      const std::string payload = sparkplug::encode(
          {.time_ms = {}, .seq = {}, .metrics = report.metrics}, sparkplug::Types::sent);
      insert.bind(1, report.device).bind_bytes(2, payload).run_once();
      bytes_ += bytes_of(report.device, payload.size());
      ++waiting_;
    }
    drop_oldest();
    execute("COMMIT");
  } catch (...) {
    // Some errors have rolled back already; a second time does no harm.
    sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);
    count();
    throw;
  }
}

void Store::drop_oldest() {
  if (bytes_ <= most_bytes_) return;
  std::int64_t last = 0;
  {
    Statement oldest(*this, "SELECT id, length(device), length(payload) FROM report ORDER BY id");
    while (bytes_ > most_bytes_ && oldest.step()) {
      last = oldest.integer(0);
      bytes_ -= static_cast<std::uint64_t>(oldest.integer(1) + oldest.integer(2)) + kRowBytes;
      --waiting_;
      ++dropped_;
    }
  }
  Statement(*this, "DELETE FROM report WHERE id <= ?").bind(1, last).run_once();
  keep("dropped", static_cast<std::int64_t>(dropped_));
}

std::vector<Store::Row> Store::read(std::int64_t after, std::size_t most) {
  std::vector<Row> rows;
  Statement read(*this, "SELECT id, device, payload FROM report WHERE id > ? ORDER BY id LIMIT ?");
  read.bind(1, after).bind(2, static_cast<std::int64_t>(most));
  while (read.step()) {
    Row row{.id = read.integer(0), .report = {.device = read.bytes(1), .metrics = {}}};
    try {
      row.report.metrics = sparkplug::decode(read.bytes(2)).metrics;
    } catch (const sparkplug::BadPayload& e) {
      throw StoreError(StoreError::Kind::damaged, fmt::format("row {}: {}", row.id, e.what()));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

void Store::remove_up_to(std::int64_t id) {
  {
    Statement gone(
        *this,
        "SELECT count(*), coalesce(sum(length(device) + length(payload)), 0) FROM report "
        "WHERE id <= ?");
    gone.bind(1, id).step();
    const auto rows = static_cast<std::uint64_t>(gone.integer(0));
    waiting_ -= rows;
    bytes_ -= static_cast<std::uint64_t>(gone.integer(1)) + kRowBytes * rows;
  }
  Statement(*this, "DELETE FROM report WHERE id <= ?").bind(1, id).run_once();
}

void Store::keep(const char* name, std::int64_t value) {
  Statement(*this, "INSERT OR REPLACE INTO kept VALUES(?, ?)")
      .bind(1, std::string(name))
      .bind(2, value)
      .run_once();
}

std::optional<std::int64_t> Store::kept(const char* name) {
  Statement read(*this, "SELECT value FROM kept WHERE name = ?");
  read.bind(1, std::string(name));
  return read.step() ? std::optional(read.integer(0)) : std::nullopt;
}

std::optional<std::uint8_t> Store::bd_seq() {
  const std::optional<std::int64_t> number = kept("bd_seq");
  return number ? std::optional(static_cast<std::uint8_t>(*number)) : std::nullopt;
}

void Store::keep_bd_seq(std::uint8_t bd_seq) { keep("bd_seq", bd_seq); }

}  // namespace loopwarden::edge
