// SPDX-License-Identifier: Apache-2.0
// Writes and reads small tables that people edit in a spreadsheet. Columns are found by their
// names.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

// Returns a cell, in quotes if necessary. A cell that a spreadsheet would read as a formula gets a
// leading ', which reading removes.
std::string csv_cell(std::string text);

struct CsvRow {
  std::size_t line = 0;
  std::vector<std::string>
      cells;  // in the order of the requested columns; empty if the column is missing
  std::vector<std::size_t> columns;  // positions of the cells in the line, in bytes from 1
};

struct CsvColumn {
  const char* name;
  bool needed = false;
};

struct CsvTable {
  std::vector<CsvRow> rows;
  char decimal = '.';  // a comma if the cells are separated by semicolons

  // Throws CommandError with "FILE:LINE:COLUMN: what".
  [[noreturn]] void fail_at(const CsvRow& row, std::size_t cell, const std::string& what) const;

  std::string file{};
};

// Reads columns in any order, in upper or lower case, and ignores others. The header sets the
// separator: comma, semicolon, tab or bar. Throws CommandError if a required column is missing or a
// quote is not closed.
CsvTable read_csv(const std::string& file, std::string_view text,
                  const std::vector<CsvColumn>& columns);

}  // namespace loopwarden::workbench
