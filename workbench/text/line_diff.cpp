// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/line_diff.hpp"

#include <algorithm>

namespace loopwarden::workbench {
namespace {

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace

std::vector<DiffLine> line_diff(std::string_view before, std::string_view after) {
  const std::vector<std::string_view> a = lines_of(before);
  const std::vector<std::string_view> b = lines_of(after);
  std::size_t head = 0;
  while (head < a.size() && head < b.size() && a[head] == b[head]) ++head;
  std::size_t tail = 0;
  while (tail < a.size() - head && tail < b.size() - head &&
         a[a.size() - 1 - tail] == b[b.size() - 1 - tail]) {
    ++tail;
  }
  const std::size_t rows = a.size() - head - tail;
  const std::size_t columns = b.size() - head - tail;

  // common[i][j]: length of the longest common subsequence from row i and column j on.
  const bool small = rows == 0 || columns <= kMostDiffCells / rows;
  const std::size_t width = columns + 1;
  std::vector<std::uint32_t> common(small ? (rows + 1) * width : 0, 0);
  for (std::size_t i = small ? rows : 0; i-- > 0;) {
    for (std::size_t j = columns; j-- > 0;) {
      common[i * width + j] = a[head + i] == b[head + j] ? common[(i + 1) * width + j + 1] + 1
                                                         : std::max(common[(i + 1) * width + j],
                                                                    common[i * width + j + 1]);
    }
  }

  std::vector<DiffLine> result;
  const auto put = [&](DiffLine::Kind kind, std::string_view line) {
    result.push_back({kind, std::string(line)});
  };
  for (std::size_t i = 0; i < head; ++i) put(DiffLine::Kind::same, a[i]);
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < rows || j < columns) {
    if (small && i < rows && j < columns && a[head + i] == b[head + j]) {
      put(DiffLine::Kind::same, a[head + i]);
      ++i;
      ++j;
    } else if (i < rows && (j == columns || !small ||
                            common[(i + 1) * width + j] >= common[i * width + j + 1])) {
      put(DiffLine::Kind::removed, a[head + i++]);
    } else {
      put(DiffLine::Kind::added, b[head + j++]);
    }
  }
  for (std::size_t k = a.size() - tail; k < a.size(); ++k) put(DiffLine::Kind::same, a[k]);
  return result;
}

}  // namespace loopwarden::workbench
