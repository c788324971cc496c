// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/csv_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"
#include "config/diagnostic.hpp"
#include "record/import/number_text.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {
namespace {

constexpr std::string_view kFormula = "=+-@";

[[noreturn]] void fail_in(const std::string& file, std::size_t line, std::size_t column,
                          const std::string& what) {
  throw CommandError(kExitData, fmt::format("{}:{}:{}: {}", file, line, column, what));
}

std::string without_guard(std::string_view cell) {
  const bool guarded =
      cell.size() > 1 && cell[0] == '\'' && kFormula.find(cell[1]) != kFormula.npos;
  return std::string(guarded ? cell.substr(1) : cell);
}

std::size_t byte_of(std::string_view line, std::string_view cell) {
  const bool within = cell.data() >= line.data() && cell.data() <= line.data() + line.size();
  return within ? static_cast<std::size_t>(cell.data() - line.data()) + 1 : 1;
}

// Index of a requested column that the table does not have.
constexpr std::size_t kNoPlace = static_cast<std::size_t>(-1);
std::vector<std::size_t> places_of(const std::string& file, std::size_t line,
                                   const std::vector<std::string_view>& header,
                                   const std::vector<CsvColumn>& columns) {
  std::vector<std::string> names;
  for (const std::string_view cell : header) names.push_back(base::lower_case(base::trimmed(cell)));
  std::vector<std::size_t> places;
  for (const CsvColumn& column : columns) {
    const auto at = std::find(names.begin(), names.end(), column.name);
    places.push_back(at == names.end() ? kNoPlace : static_cast<std::size_t>(at - names.begin()));
    if (at == names.end() && column.needed) {
      fail_in(file, line, 1,
              fmt::format("no column '{}'{}", column.name, config::suggestion(column.name, names)));
    }
  }
  return places;
}

}  // namespace

std::string csv_cell(std::string text) {
  if (!text.empty() && kFormula.find(text.front()) != kFormula.npos) text.insert(0, "'");
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

void CsvTable::fail_at(const CsvRow& row, std::size_t cell, const std::string& what) const {
  fail_in(file, row.line, row.columns[cell], what);
}

CsvTable read_csv(const std::string& file, std::string_view text,
                  const std::vector<CsvColumn>& columns) {
  CsvTable table;
  table.file = file;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  char delimiter = '\0';
  std::vector<std::size_t> places;
  record::LineCells cells;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (base::trimmed(line).empty()) continue;
    const bool is_header = delimiter == '\0';
    if (is_header) {
      delimiter = ',';
      for (const char other : {';', '\t', '|'}) {
        if (std::count(line.begin(), line.end(), other) >
            std::count(line.begin(), line.end(), delimiter)) {
          delimiter = other;
        }
      }
      table.decimal = delimiter == ';' ? ',' : '.';
    }
    std::size_t open = 0;
    if (!cells.split(line, delimiter, &open))
      fail_in(file, number, open + 1, "no closing quote in this line");
    if (is_header) {
      places = places_of(file, number, cells.cells, columns);
      continue;
    }
    CsvRow row{.line = number, .cells = {}, .columns = {}};
    for (const std::size_t place : places) {
      const bool has = place < cells.cells.size();
      row.cells.push_back(has ? without_guard(base::trimmed(cells.cells[place])) : std::string());
      row.columns.push_back(has ? byte_of(line, cells.cells[place]) : 1);
    }
    table.rows.push_back(std::move(row));
  }
  if (delimiter == '\0') places_of(file, 1, {}, columns);
  return table;
}

}  // namespace loopwarden::workbench
