// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/line_merge.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "workbench/text/line_diff.hpp"

namespace loopwarden::workbench {
namespace {

// Lines [begin, end) of the base, with the lines that replace them.
struct Hunk {
  std::size_t begin, end;
  std::vector<std::string> lines;
};

std::vector<Hunk> hunks_of(std::string_view base, std::string_view text) {
  std::vector<Hunk> hunks;
  std::size_t at = 0;
  bool open = false;
  for (DiffLine& line : line_diff(base, text)) {
    if (line.kind == DiffLine::Kind::same) {
      open = false;
      ++at;
      continue;
    }
    if (!open) hunks.push_back({at, at, {}});
    open = true;
    if (line.kind == DiffLine::Kind::removed) {
      hunks.back().end = ++at;
    } else {
      hunks.back().lines.push_back(std::move(line.text));
    }
  }
  return hunks;
}

std::vector<std::string> all_lines(std::string_view text) {
  std::vector<std::string> lines;
  for (DiffLine& line : line_diff(text, text)) lines.push_back(std::move(line.text));
  return lines;
}

// Returns whether both change a line of the base, or insert lines at the same place.
bool meet(const Hunk& a, const Hunk& b) {
  if (a.begin == b.begin && (a.begin == a.end) == (b.begin == b.end)) return true;
  return a.begin < b.end && b.begin < a.end;
}

// Returns the base's lines [begin, end) with these changes applied.
std::vector<std::string> changed(const std::vector<std::string>& base, std::size_t begin,
                                 std::size_t end, const std::vector<Hunk>& hunks) {
  std::vector<std::string> lines;
  std::size_t at = begin;
  for (const Hunk& hunk : hunks) {
    for (; at < hunk.begin; ++at) lines.push_back(base[at]);
    lines.insert(lines.end(), hunk.lines.begin(), hunk.lines.end());
    at = hunk.end;
  }
  for (; at < end; ++at) lines.push_back(base[at]);
  return lines;
}

void append_lines(std::string& text, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) text += line + "\n";
}

}  // namespace

LineMerge merge_lines(std::string_view base, std::string_view mine, std::string_view other) {
  const std::vector<std::string> lines = all_lines(base);
  const std::vector<Hunk> of_mine = hunks_of(base, mine);
  const std::vector<Hunk> of_other = hunks_of(base, other);
  LineMerge merged;
  const auto both = [&](const std::vector<std::string>& same) {
    append_lines(merged.with_mine, same);
    append_lines(merged.with_other, same);
  };
  std::size_t at = 0;
  for (auto a = of_mine.begin(), b = of_other.begin(); a != of_mine.end() || b != of_other.end();) {
    // Collects all overlapping changes.
    std::vector<Hunk> mine_here, other_here;
    const bool mine_first =
        b == of_other.end() ||
        (a != of_mine.end() && (a->begin < b->begin || (a->begin == b->begin && a->end < b->end)));
    Hunk all = mine_first ? *a : *b;
    const auto take = [&](auto& from, auto end, std::vector<Hunk>& here) {
      if (from == end || !meet(*from, all)) return false;
      all.begin = std::min(all.begin, from->begin);
      all.end = std::max(all.end, from->end);
      here.push_back(*from++);
      return true;
    };
    if (mine_first) {
      mine_here.push_back(*a++);
    } else {
      other_here.push_back(*b++);
    }
    while (take(a, of_mine.end(), mine_here) || take(b, of_other.end(), other_here)) {
    }
    both(changed(lines, at, all.begin, {}));
    LineConflict here{changed(lines, all.begin, all.end, mine_here),
                      changed(lines, all.begin, all.end, other_here)};
    at = all.end;
    if (mine_here.empty() || other_here.empty() || here.mine == here.other) {
      both(mine_here.empty() ? here.other : here.mine);
      continue;
    }
    append_lines(merged.with_mine, here.mine);
    append_lines(merged.with_other, here.other);
    merged.conflicts.push_back(std::move(here));
  }
  both(changed(lines, at, lines.size(), {}));
  return merged;
}

std::string common_lines(std::string_view one, std::string_view other) {
  std::string text;
  for (const DiffLine& line : line_diff(one, other)) {
    if (line.kind == DiffLine::Kind::same) text += line.text + "\n";
  }
  return text;
}

std::string changed_lines(std::string_view before, std::string_view after) {
  constexpr std::size_t kAround = 2;
  const std::vector<DiffLine> all = line_diff(before, after);
  std::vector<bool> shown(all.size(), false);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].kind == DiffLine::Kind::same) continue;
    const std::size_t from = i < kAround ? 0 : i - kAround;
    for (std::size_t k = from; k < std::min(all.size(), i + kAround + 1); ++k) shown[k] = true;
  }
  std::string text;
  bool gap = false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!shown[i]) {
      gap = true;
      continue;
    }
    if (gap && !text.empty()) text += "  ...\n";
    gap = false;
    const DiffLine::Kind kind = all[i].kind;
    text += kind == DiffLine::Kind::same ? "  " : kind == DiffLine::Kind::added ? "+ " : "- ";
    text += all[i].text + "\n";
  }
  return text;
}

}  // namespace loopwarden::workbench
