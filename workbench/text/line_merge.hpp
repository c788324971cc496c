// SPDX-License-Identifier: Apache-2.0
// Two texts that were made from one: the lines that each of them has changed, in one text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

// Lines that both have changed, in different ways.
struct LineConflict {
  std::vector<std::string> mine, other;
};

struct LineMerge {
  std::string with_mine;   // at each conflict the lines of `mine`
  std::string with_other;  // at each conflict those of `other`
  std::vector<LineConflict> conflicts;
};

// `base`: what both were made from. Where it is not known, give common_lines(mine, other): lines
// that only one of them has are then its own, and lines that differ are conflicts. Lines end in
// '\n' in the result.
LineMerge merge_lines(std::string_view base, std::string_view mine, std::string_view other);

// The lines that both have, in their order.
std::string common_lines(std::string_view one, std::string_view other);

// The lines that differ, with - and + before them, each place with up to two lines around it.
std::string changed_lines(std::string_view before, std::string_view after);

}  // namespace loopwarden::workbench
