// SPDX-License-Identifier: Apache-2.0
#include "lab/program/labels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "record/record_csv.hpp"

namespace loopwarden::lab {
namespace {

std::string letters_of(const std::string& name) {
  const auto end = std::find_if(name.begin(), name.end(), [](char c) {
    return (c < 'A' || c > 'Z') && (c < 'a' || c > 'z');
  });
  return end == name.begin() ? name : std::string(name.begin(), end);
}

}  // namespace

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
  const auto place_of = [&](const char* name) {
    return static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin());
  };
  const auto column = [&](const char* name) {
    const std::size_t at = place_of(name);
    if (at == header.size()) {
      throw record::RecordError(record::RecordError::Kind::data, 1, 0,
                                path.string() + ":1: no column '" + name + "'");
    }
    return at;
  };
  const std::size_t of_file = column("file");
  const std::size_t of_loop = column("loop");
  const std::size_t of_sticky = column("sticky");
  const std::size_t of_plant = place_of("plant");
  const std::size_t of_kind = place_of("kind");
  std::vector<Label> labels;
  for (std::size_t number = 2; std::getline(file, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() <= std::max({of_file, of_loop, of_sticky})) {
      throw record::RecordError(record::RecordError::Kind::data, number, 0,
                                fmt::format("{}:{}: too few cells", path.string(), number));
    }
    const std::string& name = cells[of_file];
    labels.push_back({.file = name,
                      .loop = cells[of_loop],
                      .plant = of_plant < cells.size() ? cells[of_plant] : letters_of(name),
                      .kind = of_kind < cells.size() ? cells[of_kind] : "",
                      .sticky = cells[of_sticky] == "1"});
  }
  return labels;
}

}  // namespace loopwarden::lab
