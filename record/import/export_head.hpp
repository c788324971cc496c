// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::record {

// Lines that may stand before the data.
inline constexpr std::size_t kMostHeaderRows = 60;

using Counts = std::map<std::size_t, std::size_t>;  // how often each number comes
// The end where there is none.
Counts::const_iterator most_frequent(const Counts& counts);

// The first lines of an export, and their cells.
struct ExportHead {
  ExportHead(std::string_view text, std::string file);

  // Fills `rows` and `columns`. Throws RecordError where a quote is not closed, or there is one column.
  void split(char delimiter);
  // Rows of data are the bulk: the second half of what is there.
  std::size_t bulk() const { return lines.size() / 2; }
  // Empty where the row has no such cell.
  std::string_view cell(std::size_t row, std::size_t column) const {
    return column < rows[row].size() ? std::string_view(rows[row][column]) : std::string_view();
  }
  // Throws RecordError. Line and column count from 1; 0: none in particular.
  [[noreturn]] void fail(std::size_t line, std::size_t column, const std::string& what) const;

  std::string name;
  std::vector<std::string_view> lines;
  std::vector<std::vector<std::string>> rows;
  std::size_t columns = 0;  // of most rows in the bulk
};

}  // namespace loopwarden::record
