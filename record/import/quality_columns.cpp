// SPDX-License-Identifier: Apache-2.0
#include "record/import/quality_columns.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <string_view>

#include "base/text.hpp"
#include "record/import/quality.hpp"
#include "record/import/units.hpp"

namespace loopwarden::record {
namespace {

// Returns whether the name is used for other things than qualities, too.
bool is_vague(QualityKind kind) {
  return kind == QualityKind::status || kind == QualityKind::flags;
}

class QualityFinder {
 public:
  QualityFinder(const Layout& layout, const std::vector<LoopSignals>& loops,
                const std::set<std::size_t>& with_words)
      : layout_(layout), loops_(loops), with_words_(with_words), found_(layout.names.size()) {}

  std::vector<std::vector<std::size_t>> find() {
    if (layout_.annotated && layout_.is_long) return std::move(found_);  // all columns are tags
    std::vector<std::size_t> plain;  // columns whose whole name is that of a quality
    for (std::size_t c = 0; c < found_.size(); ++c) {
      if (c == layout_.time || c == layout_.tag || c == layout_.value) continue;
      if (quality_kind(layout_.names[c]) != QualityKind::none ||
          (layout_.is_long && with_words_.count(c) > 0)) {
        plain.push_back(c);
      } else if (!layout_.is_long) {
        take_named(c);
      }
    }
    if (layout_.is_long) {
      found_[layout_.value] = plain;
    } else if (plain.size() != 1 || !take_for_row(plain.front())) {
      for (const std::size_t c : plain) {
        if (c > 0 && c - 1 != layout_.time && is_signal(c - 1)) found_[c - 1].push_back(c);
      }
    }
    return std::move(found_);
  }

 private:
  // Returns whether a role or the user names the column.
  bool is_signal(std::size_t column) const {
    const std::string& name = layout_.names[column];
    return read_tag(name).role.has_value() ||
           std::any_of(loops_.begin(), loops_.end(), [&](const LoopSignals& loop) {
             return std::find(loop.names.begin(), loop.names.end(), name) != loop.names.end();
           });
  }

  bool take_for_row(std::size_t quality) {
    std::vector<std::size_t> signals;
    for (std::size_t c = 0; c < found_.size(); ++c) {
      if (c != layout_.time && c != quality && is_signal(c)) signals.push_back(c);
    }
    if (signals.size() < 2 || (quality > signals.front() && quality < signals.back())) return false;
    for (const std::size_t c : signals) found_[c].push_back(quality);
    return true;
  }

  void take_named(std::size_t quality) {
    constexpr std::string_view kSeparators = " ._-/\\:|([";
    const std::string_view name = layout_.names[quality];
    for (std::size_t at = name.find_first_of(kSeparators); at != name.npos;
         at = name.find_first_of(kSeparators, at + 1)) {
      const std::string_view before = name.substr(0, at);
      const std::string_view behind = name.substr(at + 1);
      if (take(before, quality_kind(behind), quality)) return;
      if (take(behind, quality_kind(before), quality)) return;
    }
  }

  bool take(std::string_view of, QualityKind kind, std::size_t quality) {
    while (!of.empty() && std::string_view(" ._-/:|)]").find(of.back()) != of.npos)
      of.remove_suffix(1);
    if (of.empty() || kind == QualityKind::none) return false;
    bool found = false;
    for (std::size_t c = 0; c < found_.size(); ++c) {
      const std::string_view name = layout_.names[c];
      if (c == quality || c == layout_.time) continue;
      if (name != of && split_name(name).text != of &&
          base::trimmed(name.substr(0, name.find_first_of("(["))) != of)
        continue;
      found_[c].push_back(quality);
      found = true;
    }
    for (std::size_t c = 0; c < found_.size() && !found && !is_vague(kind); ++c) {
      const TagName tag = read_tag(layout_.names[c]);
      if (c != quality && tag.role && tag.loop == of) found_[c].push_back(quality);
    }
    return found || std::any_of(found_.begin(), found_.end(), [quality](const auto& list) {
             return std::find(list.begin(), list.end(), quality) != list.end();
           });
  }

  const Layout& layout_;
  const std::vector<LoopSignals>& loops_;
  const std::set<std::size_t>& with_words_;
  std::vector<std::vector<std::size_t>> found_;
};

}  // namespace

std::vector<std::vector<std::size_t>> find_qualities(const Layout& layout,
                                                     const std::vector<LoopSignals>& loops,
                                                     const std::set<std::size_t>& with_words) {
  return QualityFinder(layout, loops, with_words).find();
}

std::vector<std::size_t> quality_columns(const Layout& layout) {
  std::set<std::size_t> columns;
  for (const auto& list : layout.qualities_of) columns.insert(list.begin(), list.end());
  return {columns.begin(), columns.end()};
}

}  // namespace loopwarden::record
