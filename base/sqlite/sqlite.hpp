// SPDX-License-Identifier: Apache-2.0
// Opens and checks the SQLite files of this project. Statements and transactions clean up after
// themselves. Each refusal by SQLite is thrown as an Error. For one thread at a time.
#pragma once

#include <chrono>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

struct sqlite3;
struct sqlite3_stmt;

namespace loopwarden::sqlite {

class Error : public std::runtime_error {
 public:
  enum class Kind : std::uint8_t {
    damaged,        // not a valid database of this project
    other_version,  // written by another version of the program: must not be changed
    unavailable     // disk full, no permission, I/O error, locked: may work later
  };
  Error(Kind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  bool damaged() const noexcept { return kind_ == Kind::damaged; }
  bool other_version() const noexcept { return kind_ == Kind::other_version; }
  Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

// Identity of the file. file(1) and this code recognise it by its application_id.
struct Schema {
  const char* what;  // "it is no ... of version 1"
  int application_id;
  int version;
  const char* tables;
};

enum class Access : std::uint8_t { write, read };
// Effect of a power failure: normal loses the newest transactions, full loses none. The file stays
// valid with both.
enum class Sync : std::uint8_t { normal, full };

class Database {
 public:
  // Creates a missing file if `access` is write. Waits up to `patience` if another process, such as
  // a backup, holds it.
  Database(const std::filesystem::path& file, Access access, std::chrono::milliseconds patience);

  // Creates the tables of a new file. Throws an Error, without changing the file, if it belongs to
  // another program or version or is damaged. Writes use a write-ahead log: readers never make the
  // writer wait.
  void adopt(const Schema& schema, Sync sync);
  // For readers. Throws an Error if the file belongs to another program or version.
  void demand_schema(const Schema& schema);
  void execute(const std::string& sql);
  std::int64_t last_row() const noexcept;  // that was inserted last
  [[noreturn]] void fail(const char* step) const;
  sqlite3* handle() const noexcept { return handle_.get(); }

 private:
  struct Closer {
    void operator()(sqlite3* handle) const noexcept;
  };
  bool empty();
  std::int64_t number(const char* pragma);
  std::unique_ptr<sqlite3, Closer> handle_;
};

struct Blob {
  const std::string& bytes;
};

// A prepared statement, with the values of its parameters.
class Statement {
 public:
  template <class... Values>
  Statement(const Database& database, const std::string& sql, const Values&... values)
      : database_(database), statement_(prepare(sql)) {
    bind_all(values...);
  }

  // Parameters count from 1.
  void bind(int parameter, const std::string& text);
  void bind(int parameter, std::int64_t number);
  void bind(int parameter, double number);
  void bind(int parameter, const Blob& blob);
  void bind(int parameter, std::nullopt_t);
  template <std::integral Number>
  void bind(int parameter, Number number) {
    bind(parameter, static_cast<std::int64_t>(number));
  }
  template <class Value>
  void bind(int parameter, const std::optional<Value>& value) {
    value ? bind(parameter, *value) : bind(parameter, std::nullopt);
  }

  // Moves to the next row. Returns false after the last one.
  bool step();
  // Runs to the end, with these values or with the present ones. It can be run again.
  template <class... Values>
  void run(const Values&... values) {
    bind_all(values...);
    run_once();
  }

  // Columns of the present row count from 0.
  std::string text(int column) const;  // or bytes; null becomes empty
  std::int64_t integer(int column) const;
  double number(int column) const;
  bool is_null(int column) const;
  std::optional<double> number_or_null(int column) const {
    return is_null(column) ? std::nullopt : std::optional(number(column));
  }

 private:
  struct Finaliser {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };
  sqlite3_stmt* prepare(const std::string& sql) const;
  template <class... Values>
  void bind_all(const Values&... values) {
    int parameter = 0;
    (bind(++parameter, values), ...);
  }
  void run_once();
  void demand(int result, const char* step) const;

  const Database& database_;
  std::unique_ptr<sqlite3_stmt, Finaliser> statement_;
};

// Changes inside it take effect together at commit(). Without commit() they are rolled back.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) {
    database.execute("BEGIN IMMEDIATE");
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

// Moves a damaged database and its log files aside. Returns its new name. Throws
// std::filesystem::filesystem_error.
std::filesystem::path move_aside(const std::filesystem::path& file, std::int64_t utc_ms);

// Returns the result of `open` for the file. A damaged file is moved aside, `moved` receives the
// error and the new name, and `open` runs again to create a new file.
template <std::invocable Open, std::invocable<const Error&, const std::filesystem::path&> Moved>
std::invoke_result_t<Open> open_or_replace(const std::filesystem::path& file, std::int64_t utc_ms,
                                           Open open, Moved moved) {
  try {
    return open();
  } catch (const Error& e) {
    if (!e.damaged()) throw;
    moved(e, move_aside(file, utc_ms));
  }
  return open();
}

}  // namespace loopwarden::sqlite
