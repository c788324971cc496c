// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/line_diff.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace line_diff_test {

using loopwarden::workbench::DiffLine;
using loopwarden::workbench::line_diff;

namespace {

std::string marked(std::string_view before, std::string_view after) {
  std::string text;
  for (const DiffLine& line : line_diff(before, after)) {
    const char mark = line.kind == DiffLine::Kind::same      ? ' '
                      : line.kind == DiffLine::Kind::removed ? '-'
                                                             : '+';
    text += mark + line.text + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("removed and added lines are shown around unchanged lines", "[workbench][diff]") {
  CHECK(marked("a\nb\nc\n", "a\nx\nc\n") == " a\n-b\n+x\n c\n");
  CHECK(marked("a\nc\n", "a\nb\nc\n") == " a\n+b\n c\n");
  CHECK(marked("a\nb\nc\n", "b\nc\nd\n") == "-a\n b\n c\n+d\n");
  CHECK(marked("a\nb\na\nb\n", "b\na\n") == "-a\n b\n a\n-b\n");
}

TEST_CASE("equal texts, empty texts, other line ends", "[workbench][diff]") {
  CHECK(marked("a\nb", "a\nb\n") == " a\n b\n");
  CHECK(marked("a\r\n", "a\n") == " a\n");
  CHECK(marked("", "") == "");
  CHECK(marked("", "a\n") == "+a\n");
  CHECK(marked("a\n", "") == "-a\n");
}

TEST_CASE("long texts that differ throughout are compared in bounded memory", "[workbench][diff]") {
  std::string before;
  std::string after;
  for (int i = 0; i < 20'000; ++i) {
    before += "b" + std::to_string(i) + "\n";
    after += "a" + std::to_string(i) + "\n";
  }
  const auto lines = line_diff("same\n" + before, "same\n" + after);
  REQUIRE(lines.size() == 40'001);
  CHECK(lines[0].kind == DiffLine::Kind::same);
  CHECK(lines[20'000].kind == DiffLine::Kind::removed);
  CHECK(lines[20'001].kind == DiffLine::Kind::added);
}

}  // namespace line_diff_test
