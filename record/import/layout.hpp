// SPDX-License-Identifier: Apache-2.0
// The layout of an export, found from its first lines or set by the user.
//
//   wide   one column per signal, one row per time:  Timestamp;FIC101.PV;FIC101.OP;...
//   long   one row per value:                        Tag,Timestamp,Value,Quality
//   pairs  two columns per signal, with its times:   Time,FIC101.PV,Time,FIC101.OP,...
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/number_text.hpp"
#include "record/import/tag_rules.hpp"
#include "record/import/tags.hpp"
#include "record/import/text_source.hpp"
#include "record/import/time_text.hpp"

namespace loopwarden::record {

enum class Filling : std::uint8_t { automatic, held, linear };
const char* to_text(Filling filling) noexcept;

// The user's settings for an export. Settings that are not set are found automatically.
struct ImportOptions {
  std::optional<char> delimiter;
  std::optional<char> decimal;  // '.' or ','
  Encoding encoding = Encoding::automatic;
  std::optional<std::size_t> header_rows;
  TimeForm time = TimeForm::automatic;
  std::string time_column;         // name, or number from 1
  std::optional<int> zone_s;       // of local times, s east of UTC
  std::vector<LoopSignals> loops;  // otherwise by rules and the names' endings
  std::vector<TagRule> rules;
  std::vector<TagText> tags;           // texts only; no effect on what is read
  std::vector<std::string> bad_words;  // in lower case
  std::optional<double> period_s;
  Filling filling = Filling::automatic;
  double most_samples = 1e8;  // of a record
  // True: a date whose order of day and month is open is read by the usual order of its form, and
  // Layout::assumed says so. False: it is an error.
  bool assume_order = false;
  // False: a place in a line is reported by its byte. True: by its column, as in a sheet.
  bool counts_columns = false;

  bool anything_said() const noexcept;
};

// Returns all settings except the rules as text, to compare two of them.
std::string fingerprint(const ImportOptions& options);

inline constexpr std::size_t kNoColumn = static_cast<std::size_t>(-1);

struct Layout {
  char delimiter = ',';
  char decimal = '.';
  std::size_t header_rows = 1;  // lines before the first row of data
  bool is_long = false;
  bool pairs = false;  // each named column has its times in the previous column
  // False: no cell of the first lines allows one reading of the decimal mark only.
  bool decimal_known = true;
  bool decimal_by_jumps = false;  // unknown, but jumps between cells decide (decimal_marks.hpp)
  TimeForm form = TimeForm::seconds;
  std::size_t time = 0;                  // column
  std::size_t clock = kNoColumn;         // of times of day, where `time` has the dates
  std::size_t tag = kNoColumn;           // long
  std::vector<std::size_t> more_of_tag;  // columns that precede it in the tag's name
  bool annotated = false;  // format of InfluxDB: lines with #, a header before each table
  std::vector<std::string> defaults;  // annotated: values of empty cells, by column
  std::size_t value = kNoColumn;
  std::vector<std::string> names;  // of the columns
  std::vector<std::string> units;  // from a row of units, or empty
  // Columns of qualities by the column that they refer to; long: by the column of values.
  std::vector<std::vector<std::size_t>> qualities_of;
  std::string hint;     // other possible meaning of the times, for people
  std::string assumed;  // reading of the dates that the file does not prove, for people
};

// Returns the layout found from the first lines (`head`) of the file `name`. Throws RecordError
// with the option that helps.
Layout find_layout(std::string_view head, const std::string& name, const ImportOptions& options);

// Returns whether a row of an annotated file is a line with # or the header of a table.
bool is_annotation(const Layout& layout, const LineCells& row);
// Long: sets the columns for the table that begins with this header. Returns false if a required
// column is missing.
bool take_annotation(Layout& layout, const LineCells& row);

// Long: returns the tag of a row; empty if it has none. Tags of several parts are composed in
// `buffer`.
std::string_view tag_of(const Layout& layout, const LineCells& row, std::string& buffer);

// Returns the message for a row with more cells than the header.
std::string too_wide_text(std::size_t cells, const Layout& layout);

// Returns the place of `byte` in a line for messages, from 1.
std::size_t place_in_line(std::string_view line, std::size_t byte, const ImportOptions& options);

// Returns the names of the columns that are not used in a table with one row per value.
std::vector<std::string> unused_columns(const Layout& layout);

// Returns one line: "comma, decimal point, UTF-8; times ISO 8601 in column 'Timestamp'; a column a
// signal"
std::string describe(const Layout& layout, const TextSource& source);

}  // namespace loopwarden::record
