// SPDX-License-Identifier: Apache-2.0
// Finds the lines in which two texts differ, by their longest common subsequence.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

struct DiffLine {
  enum class Kind : std::uint8_t { same, removed, added };
  Kind kind;
  std::string text;

  friend bool operator==(const DiffLine&, const DiffLine&) = default;
};

// Returns all lines of both texts in order. Removed lines precede the lines that replace them. If
// the texts differ in more than kMostDiffCells pairs of lines, the whole middle part is shown as
// changed.
std::vector<DiffLine> line_diff(std::string_view before, std::string_view after);

inline constexpr std::size_t kMostDiffCells = 4'000'000;

}  // namespace loopwarden::workbench
