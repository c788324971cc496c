// SPDX-License-Identifier: Apache-2.0
// How an export is laid out: found out from its first lines, or told by the user.
//
//   wide   a column a signal, a row a time:   Timestamp;FIC101.PV;FIC101.OP;...
//   long   a row a value:                     Tag,Timestamp,Value,Quality
//   pairs  two columns a signal:              Time,FIC101.PV,Time,FIC101.OP,...   each with times of its own
#pragma once

#include <array>
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

// What the user says of an export; what is left out is found out.
struct ImportOptions {
  std::optional<char> delimiter;
  std::optional<char> decimal;  // '.' or ','
  Encoding encoding = Encoding::automatic;
  std::optional<std::size_t> header_rows;
  TimeForm time = TimeForm::automatic;
  std::string time_column;         // name, or number from 1
  std::optional<int> zone_s;       // of local times, s east of UTC
  std::vector<LoopSignals> loops;  // else by rules and the names' endings
  std::vector<TagRule> rules;
  std::vector<std::string> bad_words;  // in lower case
  std::optional<double> period_s;
  Filling filling = Filling::automatic;
  double most_samples = 1e8;  // of a record
  // Not told: the place in a line is said by its column, as a sheet has it, else by its byte.
  bool counts_columns = false;

  bool anything_said() const noexcept;
};

// All of it but the rules as text, to tell two of them apart.
std::string fingerprint(const ImportOptions& options);

inline constexpr std::size_t kNoColumn = static_cast<std::size_t>(-1);

struct Layout {
  char delimiter = ',';
  char decimal = '.';
  std::size_t header_rows = 1;  // lines before the first row of data
  bool is_long = false;
  bool pairs = false;  // each column with a name has its times in the one before it
  // False: no cell of the first lines allows one reading of the decimal mark only.
  bool decimal_known = true;
  bool decimal_by_jumps = false;  // not known, but jumps between cells decide (decimal_marks.hpp)
  TimeForm form = TimeForm::seconds;
  std::size_t time = 0;                  // column
  std::size_t clock = kNoColumn;         // of times of day, where `time` has the dates
  std::size_t tag = kNoColumn;           // long
  std::vector<std::size_t> more_of_tag;  // columns that stand before it in the tag's name
  bool annotated = false;  // as InfluxDB writes it: lines with #, a header before each table
  std::vector<std::string> defaults;  // annotated: of cells that are empty, by column
  std::size_t value = kNoColumn;
  std::vector<std::string> names;  // of the columns
  std::vector<std::string> units;  // of a row of them, or empty
  // Columns of qualities by the column that they are of; long: by the column of values.
  std::vector<std::vector<std::size_t>> qualities_of;
  std::string hint;  // what else the times may be, in words
};

// From the first lines (`head`) of the file `name`. Throws RecordError with the option that would help.
Layout find_layout(std::string_view head, const std::string& name, const ImportOptions& options);

// A line with #, or the header of a table, between the rows of an annotated file.
bool is_annotation(const Layout& layout, const LineCells& row);
// Of a row a value: the columns of the table that begins with this one. False where it lacks one that is needed.
bool take_annotation(Layout& layout, const LineCells& row);

// Long: the tag of a row, in `buffer` where it is put together; empty where the row has none.
std::string_view tag_of(const Layout& layout, const LineCells& row, std::string& buffer);

// Of a row with more cells than the header.
std::string too_wide_text(std::size_t cells, const Layout& layout);

// For messages: where in a line `byte` stands, from 1.
std::size_t place_in_line(std::string_view line, std::size_t byte, const ImportOptions& options);

// The names of columns that are neither times nor tags, values or qualities, in a table with a row
// per value.
std::vector<std::string> unused_columns(const Layout& layout);

// One line: "comma, decimal point, UTF-8; times ISO 8601 in column 'Timestamp'; a column a signal"
std::string describe(const Layout& layout, const TextSource& source);

}  // namespace loopwarden::record
