// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/line_merge.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "tests/support/property.hpp"

namespace line_merge_test {

using loopwarden::workbench::changed_lines;
using loopwarden::workbench::common_lines;
using loopwarden::workbench::LineMerge;
using loopwarden::workbench::merge_lines;

TEST_CASE("lines that only one side changed are in the merged text", "[workbench][diff]") {
  const LineMerge merged = merge_lines("a\nb\nc\nd\n", "a\nb2\nc\nd\nmine\n", "a\nb\nc2\nd\n");
  CHECK(merged.conflicts.empty());
  CHECK(merged.with_mine == "a\nb2\nc2\nd\nmine\n");
  CHECK(merged.with_other == merged.with_mine);
  // A line added at the end by one side stays after a last line that the other side changed.
  CHECK(merge_lines("a\nb\n", "a\nb\nmine\n", "a\nx\ny\n").with_mine == "a\nx\ny\nmine\n");
  CHECK(merge_lines("a\nb\nc\n", "a\nc\n", "a\nb\nc\nd\n").with_mine == "a\nc\nd\n");
  CHECK(merge_lines("", "", "a\n").with_mine == "a\n");
  CHECK(merge_lines("a\n", "a\n", "").with_mine.empty());
}

TEST_CASE("lines that both sides changed are a conflict, unless they are equal now",
          "[workbench][diff]") {
  CHECK(merge_lines("a\nb\n", "a\nc\n", "a\nc\n").conflicts.empty());
  const LineMerge merged = merge_lines("a\nb\nc\n", "a\nmine\nc\n", "a\nother\nc\n");
  REQUIRE(merged.conflicts.size() == 1);
  CHECK(merged.conflicts[0].mine == std::vector<std::string>{"mine"});
  CHECK(merged.conflicts[0].other == std::vector<std::string>{"other"});
  CHECK(merged.with_mine == "a\nmine\nc\n");
  CHECK(merged.with_other == "a\nother\nc\n");
}

TEST_CASE("without a base, different lines are a conflict", "[workbench][diff]") {
  const std::string mine = "a\nkc: 1\nc\nalarms\n";
  const std::string other = "a\nkc: 2\nc\n";
  const LineMerge merged = merge_lines(common_lines(mine, other), mine, other);
  CHECK(merged.conflicts.size() == 1);
  CHECK(merged.with_mine == mine);
  CHECK(merged.with_other == "a\nkc: 2\nc\nalarms\n");
}

TEST_CASE("changed lines are shown with their context", "[workbench][diff]") {
  CHECK(changed_lines("a\n", "a\n").empty());
  CHECK(changed_lines("1\n2\n3\n4\n5\n6\n7\n8\n9\n", "1\n2\n3\n4\nx\n6\n7\n8\n9\n10\n") ==
        "  3\n  4\n- 5\n+ x\n  6\n  7\n  8\n  9\n+ 10\n");
}

TEST_CASE("a merge keeps all lines of a text if the other side did not change it",
          "[workbench][diff]") {
  using namespace loopwarden::tests;
  const auto text = [] {
    std::string lines;
    for (auto left = property::integer(0, 8); left > 0; --left) {
      lines += std::to_string(property::integer(0, 3)) + "\n";
    }
    return lines;
  };
  property::for_all("merged lines", 500, [&] {
    const std::string base = text();
    const std::string mine = text();
    const std::string other = text();
    property::require(merge_lines(base, mine, base).with_mine == mine, "only mine changed");
    property::require(merge_lines(base, base, other).with_mine == other, "only the other changed");
    property::require(merge_lines(base, mine, mine).with_other == mine, "both changed alike");
    const LineMerge merged = merge_lines(base, mine, other);
    property::require(!merged.conflicts.empty() || merged.with_mine == merged.with_other,
                      "two results without a conflict");
  });
}

}  // namespace line_merge_test
