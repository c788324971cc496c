// SPDX-License-Identifier: Apache-2.0
// Merges two texts with a common origin: the result has the changed lines of both.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

// Lines that both texts have changed in different ways.
struct LineConflict {
  std::vector<std::string> mine, other;
};

struct LineMerge {
  std::string with_mine;   // at each conflict the lines of `mine`
  std::string with_other;  // at each conflict those of `other`
  std::vector<LineConflict> conflicts;
};

// Merges `mine` and `other`, whose common origin is `base`. Without a known origin, pass
// common_lines(mine, other): a line of only one text is then kept, and lines that differ are
// conflicts. Lines of the result end in '\n'.
LineMerge merge_lines(std::string_view base, std::string_view mine, std::string_view other);

// Returns the lines that both texts have, in order.
std::string common_lines(std::string_view one, std::string_view other);

// Returns the lines that differ, marked with - and +, with up to two lines of context around each
// place.
std::string changed_lines(std::string_view before, std::string_view after);

}  // namespace loopwarden::workbench
