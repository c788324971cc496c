// SPDX-License-Identifier: Apache-2.0
#include "record/import/tag_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <unordered_map>

#include "base/text.hpp"
#include "record/import/units.hpp"

namespace loopwarden::record {
namespace {

char lower(char c) noexcept { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

TagPattern::TagPattern(std::string text) : text_(std::move(text)) {
  for (std::size_t at = 0; at < text_.size(); ++at) {
    const char c = text_[at];
    if (c == '*' || c == '?') {
      // Two stars are equivalent to one.
      if (c == '*' && !parts_.empty() && parts_.back().kind == Kind::any) continue;
      parts_.push_back({.kind = c == '*' ? Kind::any : Kind::one});
      continue;
    }
    if (c != '[') {
      parts_.push_back({.kind = Kind::character, .character = lower(c)});
      continue;
    }
    Part part{.kind = Kind::set};
    std::size_t in = at + 1;
    if (in < text_.size() && text_[in] == '!') {
      part.excluded = true;
      ++in;
    }
    const std::size_t first = in;
    // The first character may be the bracket itself.
    for (; in < text_.size() && (text_[in] != ']' || in == first); ++in) {
      if (static_cast<unsigned char>(text_[in]) >= 0x80)
        throw std::invalid_argument("brackets hold letters without accents, digits and signs only");
      const bool range = in + 2 < text_.size() && text_[in + 1] == '-' && text_[in + 2] != ']';
      part.ranges.emplace_back(lower(text_[in]), lower(text_[range ? in + 2 : in]));
      if (range) in += 2;
    }
    if (in >= text_.size()) throw std::invalid_argument("the bracket [ is not closed by ]");
    parts_.push_back(std::move(part));
    at = in;
  }
  if (parts_.empty()) throw std::invalid_argument("a pattern is needed");
}

bool TagPattern::Part::takes(char c) const noexcept {
  switch (kind) {
    case Kind::character: return lower(c) == character;
    case Kind::set:
      return excluded != std::any_of(ranges.begin(), ranges.end(), [c](const auto& range) {
               return range.first <= lower(c) && lower(c) <= range.second;
             });
    default: return true;
  }
}

std::size_t TagPattern::wildcards() const noexcept {
  return static_cast<std::size_t>(std::count_if(
      parts_.begin(), parts_.end(), [](const Part& p) { return p.kind != Kind::character; }));
}

std::optional<std::vector<std::string>> TagPattern::match(std::string_view name) const {
  std::vector<std::pair<std::size_t, std::size_t>> took(parts_.size());  // from, to
  std::size_t part = 0;
  std::size_t at = 0;
  std::optional<std::size_t> star;  // the last star: if the rest does not match, it takes one more
  while (at < name.size() || part < parts_.size()) {
    if (part < parts_.size() && parts_[part].kind == Kind::any) {
      star = part;
      took[part++] = {at, at};
      continue;
    }
    if (part < parts_.size() && at < name.size() && parts_[part].takes(name[at])) {
      const std::size_t from = at++;
      // Takes all bytes of a character.
      while (parts_[part].kind != Kind::character && at < name.size() &&
             (static_cast<unsigned char>(name[at]) & 0xC0U) == 0x80U) {
        ++at;
      }
      took[part++] = {from, at};
      continue;
    }
    if (!star || took[*star].second >= name.size()) return std::nullopt;
    at = ++took[*star].second;
    part = *star + 1;
  }
  std::vector<std::string> found;
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    if (parts_[k].kind == Kind::character) continue;
    found.emplace_back(name.substr(took[k].first, took[k].second - took[k].first));
  }
  return found;
}

std::optional<std::string> filled_in(std::string_view text, const std::vector<std::string>& found) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] != '$') {
      out += text[at];
      continue;
    }
    const char which = ++at < text.size() ? text[at] : '\0';
    if (which == '$') {
      out += '$';
      continue;
    }
    if (which < '1' || which > '9') return std::nullopt;
    const auto number = static_cast<std::size_t>(which - '1');
    if (number >= found.size()) return std::nullopt;
    out += found[number];
  }
  return out;
}

namespace {

// Removes a unit: FT1 (m3/h) and FT1 m3/h become FT1. The index of an array, FIC[3], is no unit.
std::string_view without_unit(std::string_view name) {
  const std::size_t open = name.find_last_of("([");
  if (open == std::string_view::npos || open == 0 || (name.back() != ')' && name.back() != ']'))
    return split_name(name).text;
  const std::string_view unit = name.substr(open + 1, name.size() - open - 2);
  const bool is_number =
      std::all_of(unit.begin(), unit.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? name : base::trimmed(name.substr(0, open));
}

std::optional<std::string> loop_by(const TagRule& rule, std::string_view name) {
  auto found = rule.pattern.match(without_unit(name));
  if (!found) found = rule.pattern.match(name);
  if (!found) return std::nullopt;
  return filled_in(rule.loop, *found).value_or(rule.loop);
}

}  // namespace

std::optional<RuledTag> rule_for(const std::vector<TagRule>& rules, std::string_view name) {
  for (std::size_t k = 0; k < rules.size(); ++k) {
    if (auto loop = loop_by(rules[k], base::trimmed(name))) return RuledTag{k, std::move(*loop)};
  }
  return std::nullopt;
}

namespace {

// The meaning of a name, by a rule or by the name itself.
struct NamedSignal {
  const std::string* name;
  std::string loop;
  Role role;
  std::string unit;
  const TagRule* rule = nullptr;
  bool by_rule = false;  // the rule sets role and loop, not only other properties
};

void note_use(const std::vector<TagRule>& rules, std::string_view name, std::size_t decided,
              std::vector<RuleUse>& use) {
  use[decided].decided = true;
  for (std::size_t k = decided + 1; k < rules.size(); ++k) {
    if (!use[k].earlier && loop_by(rules[k], base::trimmed(name))) use[k].earlier = decided;
  }
}

std::optional<NamedSignal> signal_of(const std::string& name, const std::vector<TagRule>& rules,
                                     std::vector<RuleUse>& use) {
  if (name.empty()) return std::nullopt;
  const std::optional<RuledTag> ruled = rule_for(rules, name);
  const TagRule* rule = nullptr;
  if (ruled) {
    rule = &rules[ruled->rule];
    note_use(rules, name, ruled->rule, use);
    if (rule->unused) return std::nullopt;
  }
  TagName tag = read_tag(name);
  const bool by_rule = rule != nullptr && rule->role.has_value();
  if (by_rule) {
    tag.role = rule->role;
    tag.loop = ruled->loop;
  }
  if (rule != nullptr && !rule->unit.empty()) tag.unit = rule->unit;
  if (!tag.role) return std::nullopt;
  return NamedSignal{&name, std::move(tag.loop), *tag.role, std::move(tag.unit), rule, by_rule};
}

void take(LoopSignals& loop, const NamedSignal& signal) {
  const std::size_t role = index_of(signal.role);
  loop.names[role] = *signal.name;
  loop.units[role] = signal.unit;
  if (signal.rule == nullptr) return;
  if (signal.by_rule) loop.ruled_by[role] = signal.rule->place;
  loop.ranges[role] = signal.rule->range;
  if (!signal.rule->kind.empty()) loop.kind = signal.rule->kind;
  if (signal.role == Role::mode) loop.mode_words = signal.rule->mode_words;
}

}  // namespace

std::vector<std::string> idle_rules(const std::vector<TagRule>& rules,
                                    const std::vector<RuleUse>& use) {
  std::vector<std::string> idle;
  for (std::size_t k = 0; k < rules.size(); ++k) {
    const bool seen = k < use.size();
    if (seen && use[k].decided) continue;
    const std::string why =
        seen && use[k].earlier
            ? "has no effect: its names are decided earlier by " + rules[*use[k].earlier].place
            : "matches no column or tag";
    idle.push_back(
        fmt::format("{}: {} {}", rules[k].place, base::in_quotes(rules[k].pattern.text()), why));
  }
  return idle;
}

std::string clash_text(const std::string& tag, Role role, const std::string& name,
                       const std::string& ruled_by, const std::string& other,
                       const std::string& other_ruled_by) {
  const auto by = [](const std::string& rule) {
    return rule.empty() ? std::string("by its name") : "by " + rule;
  };
  return fmt::format("{}: two names are its {}: {} {} and {} {}", tag, to_text(role),
                     base::in_quotes(name), by(ruled_by), base::in_quotes(other),
                     by(other_ruled_by));
}

std::vector<LoopSignals> find_loops(const std::vector<std::string>& names,
                                    const std::vector<TagRule>& rules, std::vector<RuleUse>& use,
                                    const std::function<void(std::string)>& clash) {
  use.resize(rules.size());
  std::vector<NamedSignal> signals;
  std::vector<LoopSignals> loops;
  std::unordered_map<std::string, std::size_t> known;
  const auto loop_of = [&](const NamedSignal& signal) -> LoopSignals& {
    const auto [at, is_new] = known.try_emplace(signal.loop, loops.size());
    if (is_new) loops.push_back({.tag = signal.loop, .names = {}, .units = {}});
    return loops[at->second];
  };
  for (const std::string& name : names) {
    std::optional<NamedSignal> signal = signal_of(name, rules, use);
    if (!signal) continue;
    LoopSignals& loop = loop_of(*signal);
    const std::size_t role = index_of(signal->role);
    if (signal->by_rule && loop.has(signal->role)) {
      clash(clash_text(loop.tag, signal->role, loop.names[role], loop.ruled_by[role], name,
                       signal->rule->place));
    } else if (signal->by_rule) {
      take(loop, *signal);
    } else {
      signals.push_back(std::move(*signal));
    }
  }
  for (const NamedSignal& signal : signals) {
    LoopSignals& loop = loop_of(signal);
    if (!loop.has(signal.role)) take(loop, signal);
  }
  return loops;
}

}  // namespace loopwarden::record
