// SPDX-License-Identifier: Apache-2.0
// Reads and writes records as CSV: a header row and a constant period. Columns are found by name,
// in any order: time in s, pv, and optionally sp, co, stem, mode; others are ignored. Empty cells
// or NaN are missing samples.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/file.hpp"
#include "model/numeric/loop_record.hpp"

namespace loopwarden::record {

// An error in a record: "file:line:column: text", or without line for the file as a whole.
class RecordError : public std::runtime_error {
 public:
  enum class Kind { data, io };
  RecordError(Kind kind, std::size_t line, std::size_t column, const std::string& what)
      : std::runtime_error(what), kind_(kind), line_(line), column_(column) {}

  Kind kind() const noexcept { return kind_; }         // data: exit code 65, io: 74
  std::size_t line() const noexcept { return line_; }  // from 1; 0: the file as a whole
  std::size_t column() const noexcept {
    return column_;
  }  // byte in the line, from 1; 0: the whole
     // line

 private:
  Kind kind_;
  std::size_t line_;
  std::size_t column_;
};

// A record of a loop. Columns missing in the file are empty.
//
// `mode` is a word of a control system (AUTO, MAN, CAS, ... in any case), or the number in exports
// of the daemon: 0 manual, 1 automatic, 2 fallback. Other values count as unknown.
struct Record : numeric::LoopRecord {
  std::vector<double> time_s;  // strictly rising, complete
};

// Larger files are refused before they are parsed. About a week at 10 Hz.
inline constexpr std::size_t kLargestRecordBytes = 256UL * 1024UL * 1024UL;

// Reads `path`; - is standard input. Throws RecordError.
Record read_record(const std::filesystem::path& path,
                   std::size_t largest_bytes = kLargestRecordBytes);
// Parses a text. `name` is the file's name in error messages.
Record parse_record(std::string_view text, std::string_view name);

// Returns 1 for a mode in which the system moves the loop, 0 for manual, NaN for unknown words.
double parse_mode(std::string_view text);

// Returns the intended period for a mean of steps: 0.1 instead of 0.09999999999999999.
double tidy_period_s(double mean_s) noexcept;

// One row to write. NaN and infinity become empty cells.
struct RecordSample {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double time_s = 0.0;
  double pv = kNone;
  double sp = kNone;
  double co = kNone;
  double stem = kNone;
};

// The optional columns of a file to write.
struct RecordColumns {
  bool sp = true;
  bool co = true;
  bool stem = true;
  std::vector<std::string> more{};  // additional columns, after the standard ones
};

// Writes a record row by row into `<path>.tmp`, which finish() renames to `<path>`. Without
// finish(), or after an error, the written part keeps its temporary name. It can't be mistaken for
// a complete record, and no measurement is lost. Values are written with the fewest digits that
// read back to the same bits. Time is rounded to 15 digits, by at most 1 ns.
class RecordCsvWriter {
 public:
  // Throws RecordError if the file can't be created or if a column's name is not valid in a header.
  explicit RecordCsvWriter(std::filesystem::path path, RecordColumns columns = {});
  RecordCsvWriter(const RecordCsvWriter&) = delete;
  RecordCsvWriter& operator=(const RecordCsvWriter&) = delete;

  // `more` has a value for each of RecordColumns::more. Throws RecordError if the disk refuses.
  void add(const RecordSample& sample, std::span<const double> more = {});
  // Passes buffered data to the operating system. Throws RecordError.
  void flush();
  // Flushes, waits until the disk has the file and renames it. Throws RecordError.
  void finish();

  std::size_t rows() const noexcept { return rows_; }
  const std::filesystem::path& path() const noexcept { return path_; }
  const std::filesystem::path& temporary_path() const noexcept { return temporary_path_; }

 private:
  void append(double value);

  std::filesystem::path path_;
  std::filesystem::path temporary_path_;
  RecordColumns columns_;
  std::string buffer_;
  std::size_t rows_ = 0;
  int error_ = 0;  // errno of the first failure: an incomplete file is never finished
  base::File file_;
};

// Writes the whole record with its columns. Throws RecordError.
void write_record(const Record& record, const std::filesystem::path& path);

}  // namespace loopwarden::record
