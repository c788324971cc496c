// SPDX-License-Identifier: Apache-2.0
#include "record/import/export_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/text.hpp"
#include "record/import/number_text.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::record {

Counts::const_iterator most_frequent(const Counts& counts) {
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
}

ExportHead::ExportHead(std::string_view text, std::string file) : name(std::move(file)) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back(line);
  }
  while (!lines.empty() && base::trimmed(lines.back()).empty()) lines.pop_back();
}

void ExportHead::fail(std::size_t line, std::size_t column, const std::string& what) const {
  std::string place = name;
  if (line > 0) place += fmt::format(":{}", line);
  if (column > 0) place += fmt::format(":{}", column);
  throw RecordError(RecordError::Kind::data, line, column, place + ": " + what);
}

void ExportHead::split(char delimiter) {
  LineCells cells;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    std::size_t open = 0;
    if (!cells.split(lines[k], delimiter, &open)) {
      fail(k + 1, open + 1, "no closing quote in this line");
    }
    rows.emplace_back(cells.cells.begin(), cells.cells.end());
  }
  Counts counts;
  for (std::size_t k = bulk(); k < rows.size(); ++k) ++counts[rows[k].size()];
  columns = most_frequent(counts)->first;
  if (columns < 2) {
    fail(1, 1,
         fmt::format("one column: nothing is set apart by {} (--delimiter)",
                     base::in_quotes(std::string(1, delimiter))));
  }
}

}  // namespace loopwarden::record
