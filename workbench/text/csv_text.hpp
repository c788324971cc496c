// SPDX-License-Identifier: Apache-2.0
// Small tables that people keep in a spreadsheet: written, and read by the names of their columns.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

// In quotes where it needs them; what a spreadsheet would take for a formula gets a ' before it, which reading takes off.
std::string csv_cell(std::string text);

struct CsvRow {
  std::size_t line = 0;
  std::vector<std::string>
      cells;  // in the order of the columns that were asked for; empty where there is none
  std::vector<std::size_t> columns;  // of the cells, in bytes of the line, from 1
};

struct CsvColumn {
  const char* name;
  bool needed = false;
};

struct CsvTable {
  std::vector<CsvRow> rows;
  char decimal = '.';  // a comma where the cells stand between semicolons

  // Throws CommandError: "FILE:LINE:COLUMN: what".
  [[noreturn]] void fail_at(const CsvRow& row, std::size_t cell, const std::string& what) const;

  std::string file{};
};

// Columns in any order, upper or lower case, others passed over; comma, semicolon, tab or bar as the header has it. Throws
// CommandError where a needed column is missing, or a quote is not closed.
CsvTable read_csv(const std::string& file, std::string_view text,
                  const std::vector<CsvColumn>& columns);

}  // namespace loopwarden::workbench
