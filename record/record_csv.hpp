// SPDX-License-Identifier: Apache-2.0
// Records as CSV: a header row, columns by name in any order (time in s, pv, and where known sp,
// co, stem, mode; others are ignored), a constant period, empty cells or NaN for missing samples.
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

namespace loopwarden::record {

// What is wrong with a record, as "file:line:column: text" where there is a line.
class RecordError : public std::runtime_error {
 public:
  enum class Kind { data, io };
  RecordError(Kind kind, std::size_t line, std::size_t column, const std::string& what)
      : std::runtime_error(what), kind_(kind), line_(line), column_(column) {}

  Kind kind() const noexcept { return kind_; }             // data: exit code 65, io: 74
  std::size_t line() const noexcept { return line_; }      // from 1; 0: the file as a whole
  std::size_t column() const noexcept { return column_; }  // byte in the line, from 1; 0: none

 private:
  Kind kind_;
  std::size_t line_;
  std::size_t column_;
};

// `mode` is a word of a control system (AUTO, MAN, CAS, ... in any case) or the number that an export of the
// daemon's has (0 manual, 1 automatic, 2 fallback); what is neither is not known.
//
// Columns of equal length; those the file does not have are empty. NaN marks a missing sample.
struct Record {
  std::vector<double> time_s;     // strictly rising, complete
  std::vector<double> pv;         // PV units
  std::vector<double> sp;         // PV units
  std::vector<double> co;         // CO units
  std::vector<double> stem;       // CO units
  std::vector<double> automatic;  // 1: a controller moved CO, 0: it did not, NaN: not known
  bool has_sp = false;
  bool has_co = false;
  bool has_stem = false;
  bool has_mode = false;
  std::size_t missing_pv = 0;  // empty cells
  std::size_t missing_sp = 0;
  std::size_t missing_co = 0;
  std::size_t missing_stem = 0;
  double period_s = 0.0;  // s, > 0

  std::size_t size() const noexcept { return time_s.size(); }
};

// Larger files are refused before they are parsed. About a week at 10 Hz.
inline constexpr std::size_t kLargestRecordBytes = 256UL * 1024UL * 1024UL;

// `path` - is standard input. Throws RecordError.
Record read_record(const std::filesystem::path& path,
                   std::size_t largest_bytes = kLargestRecordBytes);
// `name` stands for the file in error messages.
Record parse_record(std::string_view text, std::string_view name);

// What control systems call a loop that they move themselves: 1; moved by hand: 0; not known: NaN.
double parse_mode(std::string_view text);

// A mean of steps as its writer meant it: 0.1 and not 0.09999999999999999.
double tidy_period_s(double mean_s) noexcept;

// One row to write. What is not finite becomes an empty cell.
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
  std::vector<std::string> more{};  // further columns, behind the known ones
};

// Writes a record row by row into `<path>.tmp`, which finish() makes `<path>`. Without finish(), or
// after an error, the part that was written stays under its temporary name: nobody takes it for a
// whole record, and nothing measured is thrown away. Values are written so that reading gives the
// same bits back in the fewest digits; time is rounded to 15 digits, by at most 1 ns.
class RecordCsvWriter {
 public:
  // Throws RecordError if the file can't be created or a column's name is not fit for a header.
  explicit RecordCsvWriter(std::filesystem::path path, RecordColumns columns = {});
  RecordCsvWriter(const RecordCsvWriter&) = delete;
  RecordCsvWriter& operator=(const RecordCsvWriter&) = delete;

  // `more` holds a value for each of RecordColumns::more. Throws RecordError when the disk refuses.
  void add(const RecordSample& sample, std::span<const double> more = {});
  // Hands what is buffered to the operating system. Throws RecordError.
  void flush();
  // Flushes, waits until the disk has the file and gives it its name. Throws RecordError.
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
  int error_ = 0;  // errno of the first failure: a file with a hole is never finished
  base::File file_;
};

// The whole record with the columns it has. Throws RecordError.
void write_record(const Record& record, const std::filesystem::path& path);

}  // namespace loopwarden::record
