// SPDX-License-Identifier: Apache-2.0
#include "studies/program/labels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "record/record_csv.hpp"

namespace loopwarden::studies {

std::vector<Label> read_labels(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    throw record::RecordError(record::RecordError::Kind::io, 0, 0,
                              path.string() + ": can't be read");
  }
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream stream(line.substr(0, line.find('\r')));
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> header = cells_of(line);
  const auto column = [&](const char* name) {
    const auto at = std::find(header.begin(), header.end(), name);
    if (at == header.end()) {
      throw record::RecordError(record::RecordError::Kind::data, 1, 0,
                                path.string() + ":1: no column '" + name + "'");
    }
    return static_cast<std::size_t>(at - header.begin());
  };
  const std::size_t of_file = column("file");
  const std::size_t of_loop = column("loop");
  const std::size_t of_sticky = column("sticky");
  std::vector<Label> labels;
  for (std::size_t number = 2; std::getline(file, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() <= std::max({of_file, of_loop, of_sticky})) {
      throw record::RecordError(record::RecordError::Kind::data, number, 0,
                                fmt::format("{}:{}: too few cells", path.string(), number));
    }
    labels.push_back(
        {.file = cells[of_file], .loop = cells[of_loop], .sticky = cells[of_sticky] == "1"});
  }
  return labels;
}

}  // namespace loopwarden::studies
