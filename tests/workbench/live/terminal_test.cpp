// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/terminal.hpp"

#include <catch2/catch.hpp>

#include <limits>
#include <string>
#include <vector>

namespace loopwarden::workbench::terminal_test {
namespace {

// Returns the number of cells of a line that contain dots. Braille characters have three bytes that
// start with E2 A0..A3.
int dotted(const std::string& line) {
  int cells = 0;
  for (std::size_t i = 0; i + 2 < line.size(); ++i) {
    const auto lead = static_cast<unsigned char>(line[i]);
    const auto next = static_cast<unsigned char>(line[i + 1]);
    if (lead == 0xE2 && next >= 0xA0 && next <= 0xA3) ++cells;
  }
  return cells;
}

std::vector<std::string> plotted(const std::vector<double>& values, int columns, int rows,
                                 int per_dot = 1) {
  const std::vector<Series> series{{values, Colour::plain}};
  return plot(series, 0.0, 10.0, columns + kScaleColumns, rows, per_dot);
}

TEST_CASE("a constant fills one line at its height, the newest value at the right") {
  const auto lines = plotted(std::vector<double>(20, 10.0), 20, 5);
  REQUIRE(lines.size() == 5);
  CHECK(dotted(lines[0]) == 10);  // two samples per cell
  for (std::size_t i = 1; i < 5; ++i) CHECK(dotted(lines[i]) == 0);
}

TEST_CASE("a step is drawn with a vertical stroke") {
  std::vector<double> values(10, 0.0);
  values.insert(values.end(), 10, 10.0);
  for (const std::string& line : plotted(values, 10, 6)) CHECK(dotted(line) >= 1);
}

TEST_CASE("missing values leave a hole, values outside the range are drawn at the edge") {
  std::vector<double> values(20, std::numeric_limits<double>::quiet_NaN());
  values[0] = 50.0;
  values[19] = -50.0;
  const auto lines = plotted(values, 10, 4);
  CHECK(dotted(lines[0]) == 1);
  CHECK(dotted(lines[3]) == 1);
  CHECK(dotted(lines[1]) + dotted(lines[2]) == 0);
}

TEST_CASE("with several samples per dot, a spike between two dots stays visible") {
  std::vector<double> values(200, 0.0);
  values[101] = 10.0;
  CHECK(dotted(plotted(values, 10, 5, 10)[0]) == 1);
}

TEST_CASE("colours can be switched off") {
  use_colours(false);
  CHECK(coloured("x", Colour::red) == "x");
}

}  // namespace
}  // namespace loopwarden::workbench::terminal_test
