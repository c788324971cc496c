// SPDX-License-Identifier: Apache-2.0
// The site's own rules for names: which column or tag is which signal of which loop, and what is known of it. The first
// rule that matches a name decides.
//
// Patterns are those of a shell and no regular expressions: engineers know them, and a match takes no longer than the
// product of both lengths, whatever is written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "record/import/tags.hpp"

namespace loopwarden::record {

// `*` any characters or none, `?` one, `[A-C7]` one of these, `[!0-9]` one that is none of these; all else stands for
// itself. Upper and lower case of ASCII are the same.
class TagPattern {
 public:
  TagPattern() = default;
  // Throws std::invalid_argument: a bracket that is not closed, an empty one.
  explicit TagPattern(std::string text);

  const std::string& text() const noexcept { return text_; }
  std::size_t wildcards() const noexcept;
  // What stands at the wildcards, from the left; each * but the last takes as little as it can. Nothing where `name` is
  // another one.
  std::optional<std::vector<std::string>> match(std::string_view name) const;

 private:
  enum class Kind : std::uint8_t { character, one, set, any };
  struct Part {
    Kind kind = Kind::character;
    char character = 0;
    bool excluded = false;  // of a set: what is not in it
    std::vector<std::pair<char, char>> ranges{};

    bool takes(char c) const noexcept;
  };
  std::string text_;
  std::vector<Part> parts_;
};

// `text` with $1 to $9 as what stands at the wildcards and $$ as a dollar sign. Nothing where it asks for more than there
// are, or a $ has something else behind it.
std::optional<std::string> filled_in(std::string_view text, const std::vector<std::string>& found);

struct TagRule {
  TagPattern pattern;
  std::string place{};  // for messages: FILE:LINE
  // Both, or what the name tells; `unused`: the name is no loop's.
  std::optional<Role> role{};
  std::string loop{};  // as filled_in takes it
  bool unused = false;
  std::string unit{};
  std::optional<SignalRange> range{};
  std::string kind{};                             // of the loop
  std::shared_ptr<const ModeWords> mode_words{};  // of role mode
};

struct RuledTag {
  std::size_t rule = 0;  // of the list
  std::string loop{};    // empty where the rule has none
};

// The first that matches `name` without a unit in brackets at its end, or all of it.
std::optional<RuledTag> rule_for(const std::vector<TagRule>& rules, std::string_view name);

// Whether rules were used while names came by.
struct RuleUse {
  bool decided = false;
  std::optional<std::size_t> earlier{};  // that decided of a name that this one matches as well
};

// Rules that decide of no name, each with the reason.
std::vector<std::string> idle_rules(const std::vector<TagRule>& rules,
                                    const std::vector<RuleUse>& use);

// Loops in the order in which they first appear; of two names with one role in one loop the first. Those without a PV are
// in the list too: the caller says what is missing. What a rule says of a name comes before what the name itself tells.
// `use` gets one for each rule. `clash` is called with a sentence where two names are the same signal of one loop by rule.
std::vector<LoopSignals> find_loops(const std::vector<std::string>& names,
                                    const std::vector<TagRule>& rules, std::vector<RuleUse>& use,
                                    const std::function<void(std::string)>& clash);

// That two names are the same signal of one loop; `ruled_by` is empty of a name that tells it by itself.
std::string clash_text(const std::string& tag, Role role, const std::string& name,
                       const std::string& ruled_by, const std::string& other,
                       const std::string& other_ruled_by);

}  // namespace loopwarden::record
