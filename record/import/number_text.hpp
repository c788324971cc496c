// SPDX-License-Identifier: Apache-2.0
// Numbers, bad values and the cells they stand in, as exports have them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::record {

// The whole of `text` as a finite number, with '.' or ',' before its decimals. Thousands may be set apart by the other
// of the two, by an apostrophe or by a narrow space where they stand in threes.
std::optional<double> parse_number(std::string_view text, char decimal);

// What a cell of measured values says.
enum class Cell : std::uint8_t {
  number,
  empty,
  bad,           // "Bad Input", "No Data", "I/O Timeout", NaN, ...
  questionable,  // a number marked as doubtful, or the word
  unknown        // nothing of this
};
struct CellValue {
  Cell cell = Cell::unknown;
  double value = 0.0;
};
// `bad_words`: more of them, in lower case.
CellValue parse_value(std::string_view text, char decimal,
                      const std::vector<std::string>& bad_words);

// Of a column of qualities: a word, or a code of OPC DA (192 and above good, 64 to 191 uncertain, else bad).
enum class SampleQuality : std::uint8_t { good, questionable, bad };
// `zero_is_good`: as in OPC UA, where the status of a good sample is 0.
SampleQuality parse_quality(std::string_view text, bool zero_is_good);

// The cells of a line. A cell in double quotes may hold the delimiter; a doubled quote is one. Views into the line,
// or, where a doubled quote had to be undone, into `undone`.
struct LineCells {
  std::vector<std::string_view> cells;
  std::vector<std::string> undone;

  // False where a quote is not closed; `at` is then its byte, from 0.
  bool split(std::string_view line, char delimiter, std::size_t* at = nullptr);
};

}  // namespace loopwarden::record
