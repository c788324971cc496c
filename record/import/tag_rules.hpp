// SPDX-License-Identifier: Apache-2.0
// The site's own rules for names: they assign a column or tag to a signal of a loop and set its
// properties. The first rule that matches a name decides.
//
// Patterns are shell patterns, not regular expressions: engineers know them, and the time of a
// match is bounded by the product of both lengths.
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

// A shell pattern: `*` any characters or none, `?` one, `[A-C7]` one of these, `[!0-9]` one that is
// not in the set. All other characters match themselves. ASCII case is ignored.
class TagPattern {
 public:
  TagPattern() = default;
  // Throws std::invalid_argument for a bracket that is not closed or is empty.
  explicit TagPattern(std::string text);

  const std::string& text() const noexcept { return text_; }
  std::size_t wildcards() const noexcept;
  // Returns the texts that the wildcards match, from the left. Each * except the last matches as
  // little as possible. Returns nullopt if `name` does not match.
  std::optional<std::vector<std::string>> match(std::string_view name) const;

 private:
  enum class Kind : std::uint8_t { character, one, set, any };
  struct Part {
    Kind kind = Kind::character;
    char character = 0;
    bool excluded = false;  // of a set: matches characters that are not in it
    std::vector<std::pair<char, char>> ranges{};

    bool takes(char c) const noexcept;
  };
  std::string text_;
  std::vector<Part> parts_;
};

// Returns `text` in which $1 to $9 are replaced by the texts of the wildcards and $$ by a dollar
// sign. Returns nullopt for a number above that of the wildcards, or another character after $.
std::optional<std::string> filled_in(std::string_view text, const std::vector<std::string>& found);

struct TagRule {
  TagPattern pattern;
  std::string place{};  // for messages: FILE:LINE
  // Role and loop; if one is not set, the name decides it. `unused`: the name belongs to no loop.
  std::optional<Role> role{};
  std::string loop{};  // text for filled_in()
  bool unused = false;
  std::string unit{};
  std::optional<SignalRange> range{};
  std::string kind{};                             // of the loop
  std::shared_ptr<const ModeWords> mode_words{};  // for role mode
};

// How the loops whose tag matches are shown, and their place in the plant.
struct TagText {
  TagPattern pattern;
  std::string place{};           // for messages: FILE:LINE
  std::string show{};            // texts for filled_in(); empty: by the tag itself
  std::string area{}, master{};  // area as a path: Unit 2/Reactor; tag of the master loop
};

struct RuledTag {
  std::size_t rule = 0;  // index in the list
  std::string loop{};    // empty if the rule has none
};

// Returns the first rule that matches `name`, with or without a unit in brackets at its end.
std::optional<RuledTag> rule_for(const std::vector<TagRule>& rules, std::string_view name);

// Use of a rule for the names seen so far.
struct RuleUse {
  bool decided = false;
  std::optional<std::size_t> earlier{};  // earlier rule that decided a name that this rule matches
                                         // as well
};

// Returns the rules that decide no name, each with the reason.
std::vector<std::string> idle_rules(const std::vector<TagRule>& rules,
                                    const std::vector<RuleUse>& use);

// Returns loops in the order in which they first appear. If two names have one role in one loop,
// the first is used. Loops without a PV are included; the caller reports the missing signal. A rule
// for a name has priority over the name itself. `use` gets one entry for each rule. `clash` is
// called with a sentence if rules make two names the same signal of one loop.
std::vector<LoopSignals> find_loops(const std::vector<std::string>& names,
                                    const std::vector<TagRule>& rules, std::vector<RuleUse>& use,
                                    const std::function<void(std::string)>& clash);

// Returns the message that two names are the same signal of one loop. `ruled_by` is empty if the
// name itself decides.
std::string clash_text(const std::string& tag, Role role, const std::string& name,
                       const std::string& ruled_by, const std::string& other,
                       const std::string& other_ruled_by);

}  // namespace loopwarden::record
