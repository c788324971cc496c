// SPDX-License-Identifier: Apache-2.0
#include "base/sqlite/sqlite.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

namespace loopwarden::sqlite {

void Database::Closer::operator()(sqlite3* handle) const noexcept { sqlite3_close(handle); }

Database::Database(const std::filesystem::path& file, Access access,
                   std::chrono::milliseconds patience) {
  const int flags =
      access == Access::read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* opened = nullptr;
  const int result = sqlite3_open_v2(file.c_str(), &opened, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(opened);
  if (result != SQLITE_OK) throw Error(Error::Kind::unavailable, sqlite3_errmsg(opened));
  sqlite3_extended_result_codes(opened, 1);
  sqlite3_busy_timeout(opened, static_cast<int>(patience.count()));
}

std::int64_t Database::number(const char* pragma) {
  Statement read(*this, pragma);
  return read.step() ? read.integer(0) : 0;
}

void Database::demand_schema(const Schema& schema) {
  const std::int64_t version = number("PRAGMA user_version");
  if (number("PRAGMA application_id") != schema.application_id) {
    throw Error(Error::Kind::damaged,
                fmt::format("it is no {} of version {}", schema.what, schema.version));
  }
  if (version == schema.version) return;
  // The write-ahead log is left as it is: only the version that wrote it may process it.
  sqlite3_db_config(handle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  throw Error(
      Error::Kind::other_version,
      fmt::format("{} is a {} of version {}, this program knows version {}. The file is not "
                  "changed. Install the version of Loopwarden that wrote it, or move the file away "
                  "to start a new one",
                  sqlite3_db_filename(handle(), "main"), schema.what, version, schema.version));
}

void Database::adopt(const Schema& schema, Sync sync) {
  const bool fresh =
      number("PRAGMA user_version") == 0 && number("PRAGMA application_id") == 0 && empty();
  if (!fresh) demand_schema(schema);
  execute("PRAGMA journal_mode=WAL");
  execute(sync == Sync::full ? "PRAGMA synchronous=FULL" : "PRAGMA synchronous=NORMAL");
  execute("PRAGMA journal_size_limit=1048576");
  if (fresh) {
    Transaction transaction(*this);
    execute(schema.tables);
    execute(fmt::format("PRAGMA application_id={}", schema.application_id));
    execute(fmt::format("PRAGMA user_version={}", schema.version));
    return transaction.commit();
  }
  Statement quick(*this, "PRAGMA quick_check(1)");
  if (!quick.step() || quick.text(0) != "ok") throw Error(Error::Kind::damaged, quick.text(0));
}

bool Database::empty() { return !Statement(*this, "SELECT 1 FROM sqlite_master LIMIT 1").step(); }

void Database::execute(const std::string& sql) {
  if (sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail("execute");
}

std::int64_t Database::last_row() const noexcept { return sqlite3_last_insert_rowid(handle()); }

void Database::fail(const char* step) const {
  const int code = sqlite3_errcode(handle()) & 0xFF;
  // SQLITE_ERROR: the tables of the file are not those of our schema.
  const bool damaged = code == SQLITE_CORRUPT || code == SQLITE_NOTADB || code == SQLITE_ERROR;
  throw Error(damaged ? Error::Kind::damaged : Error::Kind::unavailable,
              fmt::format("{}: {}", step, sqlite3_errmsg(handle())));
}

// --- statements ---

void Statement::Finaliser::operator()(sqlite3_stmt* statement) const noexcept {
  sqlite3_finalize(statement);
}

sqlite3_stmt* Statement::prepare(const std::string& sql) const {
  sqlite3_stmt* statement = nullptr;
  demand(sqlite3_prepare_v2(database_.handle(), sql.c_str(), -1, &statement, nullptr), "prepare");
  return statement;
}

void Statement::demand(int result, const char* step) const {
  if (result != SQLITE_OK) database_.fail(step);
}

void Statement::bind(int parameter, const std::string& text) {
  demand(sqlite3_bind_text64(statement_.get(), parameter, text.data(), text.size(),
                             SQLITE_TRANSIENT, SQLITE_UTF8),
         "bind");
}

void Statement::bind(int parameter, std::int64_t number) {
  demand(sqlite3_bind_int64(statement_.get(), parameter, number), "bind");
}

void Statement::bind(int parameter, double number) {
  demand(sqlite3_bind_double(statement_.get(), parameter, number), "bind");
}

void Statement::bind(int parameter, const Blob& blob) {
  demand(sqlite3_bind_blob64(statement_.get(), parameter, blob.bytes.data(), blob.bytes.size(),
                             SQLITE_TRANSIENT),
         "bind");
}

void Statement::bind(int parameter, std::nullopt_t) {
  demand(sqlite3_bind_null(statement_.get(), parameter), "bind");
}

bool Statement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result != SQLITE_ROW && result != SQLITE_DONE) database_.fail("step");
  return result == SQLITE_ROW;
}

void Statement::run_once() {
  step();
  sqlite3_reset(statement_.get());
}

std::string Statement::text(int column) const {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  return bytes == nullptr
             ? std::string()
             : std::string(bytes, bytes + sqlite3_column_bytes(statement_.get(), column));
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::number(int column) const {
  return sqlite3_column_double(statement_.get(), column);
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

// --- transactions ---

Transaction::~Transaction() {
  // Some errors have rolled back already; a second time does no harm.
  if (open_) sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

// --- files ---

std::filesystem::path move_aside(const std::filesystem::path& file, std::int64_t utc_ms) {
  std::filesystem::path aside = fmt::format("{}.damaged-{}", file.string(), utc_ms);
  std::filesystem::rename(file, aside);
  // SQLite would apply a log of the old database to the new one.
  for (const char* belongs : {"-wal", "-shm"}) {
    if (std::filesystem::exists(file.string() + belongs)) {
      std::filesystem::rename(file.string() + belongs, aside.string() + belongs);
    }
  }
  return aside;
}

}  // namespace loopwarden::sqlite
