// SPDX-License-Identifier: Apache-2.0
// Parses numbers, bad values and their cells in exports.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::record {

// Reads the whole of `text` as a finite number with '.' or ',' as decimal mark. The other mark, an
// apostrophe or a blank may separate thousands, also those of more than one byte (U+2019, U+00A0,
// U+202F, ...). Groups have three digits, or are those of India (12,34,567).
std::optional<double> parse_number(std::string_view text, char decimal);

// Returns the position after the digits and marks at the beginning of `text`; 0 without a digit.
std::size_t number_end(std::string_view text) noexcept;

// The readings that the marks of a number allow. `open`: one mark before exactly three digits, as
// in 1,045, may be a decimal mark or a thousands mark.
enum class Marks : std::uint8_t {
  none,  // no number
  whole,
  point_decimal,
  comma_decimal,
  point_open,
  comma_open
};
Marks marks_of(std::string_view text);

// The content of a cell of measured values.
enum class Cell : std::uint8_t {
  number,
  empty,
  bad,           // "Bad Input", "No Data", "I/O Timeout", NaN, ...
  questionable,  // a number marked as doubtful, or the word
  unknown        // any other text
};
struct CellValue {
  Cell cell = Cell::unknown;
  double value = 0.0;
  std::string_view unit;  // of a number: "12.51 °C"
};
// `bad_words`: additional words for bad values, in lower case.
CellValue parse_value(std::string_view text, char decimal,
                      const std::vector<std::string>& bad_words);

// The cells of a line. A cell in double quotes may contain the delimiter; two double quotes in it
// mean one. Cells are views into the line, or into `undone` if double quotes were replaced.
struct LineCells {
  std::vector<std::string_view> cells;
  std::vector<std::string> undone;

  // Returns false if a quote is not closed; `at` is then its byte, from 0.
  bool split(std::string_view line, char delimiter, std::size_t* at = nullptr);
};

}  // namespace loopwarden::record
