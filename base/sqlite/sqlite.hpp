// SPDX-License-Identifier: Apache-2.0
// A SQLite file of this project's: opened and checked, statements and transactions that clean up after themselves.
// Whatever SQLite refuses is an Error. For one thread at a time.
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
    damaged,        // it is no sound database of ours
    other_version,  // written by another version of the program: not to be touched
    unavailable     // disk full, no rights, I/O error, locked: may work later
  };
  Error(Kind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  bool damaged() const noexcept { return kind_ == Kind::damaged; }
  bool other_version() const noexcept { return kind_ == Kind::other_version; }
  Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

// What the file says of itself: its application_id tells file(1) and us whose it is.
struct Schema {
  const char* what;  // "it is no ... of version 1"
  int application_id;
  int version;
  const char* tables;
};

enum class Access : std::uint8_t { write, read };
// What a power failure takes back: the newest transactions, or none. The file stays sound in both.
enum class Sync : std::uint8_t { normal, full };

class Database {
 public:
  // Makes the file if there is none and `access` is write. Waits up to `patience` if another process, such as a backup,
  // holds it.
  Database(const std::filesystem::path& file, Access access, std::chrono::milliseconds patience);

  // Makes the tables of a new file. One that is another's, of another version or damaged is an error, and is not
  // touched. Writes go to a write-ahead log: readers never make the writer wait.
  void adopt(const Schema& schema, Sync sync);
  // For who only reads: a file that is another's or of another version is an error.
  void demand_schema(const Schema& schema);
  void execute(const std::string& sql);
  std::int64_t last_row() const noexcept;  // that was inserted
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

  // True while there are rows.
  bool step();
  // To its end, with these values or those that it has; it can be run again.
  template <class... Values>
  void run(const Values&... values) {
    bind_all(values...);
    run_once();
  }

  // Of the row; columns count from 0.
  std::string text(int column) const;  // or bytes; null is empty
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

// All or, without commit(), nothing.
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

// Moves a damaged database and what belongs to it aside; returns its new name. Throws
// std::filesystem::filesystem_error.
std::filesystem::path move_aside(const std::filesystem::path& file, std::int64_t utc_ms);

// What `open` makes of the file. Where that is damaged, it is moved aside, `moved` hears of the error and of the new name,
// and `open` makes another one.
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
