// SPDX-License-Identifier: Apache-2.0
#include "workbench/discover/found_loops.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "base/text.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/text/letters.hpp"

namespace loopwarden::workbench::discover {
namespace {

using record::index_of;
using record::InstrumentName;
using record::LoopSignals;
using record::Role;
using record::SignalRange;

// Values of a mode if no rule gives them: numbers as record::parse_mode reads them, and words.
constexpr const char* kAutomatic = "1";
constexpr const char* kManual = "0";
constexpr std::array<std::string_view, 10> kAutomaticWords{
    "Auto", "Aut", "Automatic", "Cas", "Casc", "Cascade", "RCas", "Rsp", "Remote", "BCas"};
constexpr std::array<std::string_view, 6> kManualWords{"Man", "Manual", "IMan",
                                                       "LO",  "ROut",   "OOS"};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

// Returns a word in the case of `example`: AUTO, Auto or auto. An empty example counts as AUTO.
std::string in_case_of(std::string_view word, std::string_view example) {
  if (!example.empty() && is_lower(example.front())) return base::lower_case(word);
  const auto raise = [](char& c) {
    if (is_lower(c)) c = static_cast<char>(c - 'a' + 'A');
  };
  std::string text(word);
  if (std::any_of(example.begin(), example.end(), is_lower)) {
    raise(text.front());
  } else {
    std::for_each(text.begin(), text.end(), raise);
  }
  return text;
}

// A loop under construction. `path` holds its folders, its tag and perhaps a block.
struct Candidate {
  std::vector<std::string> path;
  Found<std::string> tag{};
  LoopSignals signals{};
  std::array<std::string, record::kRoles> guesses{};

  bool has(Role role) const { return signals.has(role); }
  bool is_whole() const { return has(Role::pv) && has(Role::co); }
  // Takes `role` from `other`.
  void take(const Candidate& other, Role role, const std::string& guess) {
    const std::size_t k = index_of(role);
    signals.names[k] = other.signals.names[k];
    signals.units[k] = other.signals.units[k];
    signals.ranges[k] = other.signals.ranges[k];
    if (role == Role::mode) signals.mode_words = other.signals.mode_words;
    guesses[k] = guess.empty() ? other.guesses[k] : guess;
  }
};

std::vector<std::string> split_path(const std::string& loop) {
  std::vector<std::string> path;
  std::string part;
  for (const char c : loop + "/") {
    if (std::string_view("/\\.:|").find(c) == std::string_view::npos) {
      part += c;
    } else if (!part.empty()) {
      path.push_back(std::exchange(part, {}));
    }
  }
  return path;
}

std::string joined(const std::vector<std::string>& path, const char* between) {
  return fmt::format("{}", fmt::join(path, between));
}

// Returns whether a name is a block within a loop, such as PID, PID1, PIDE_02 or CTRL.
bool is_block(std::string_view name) {
  while (!name.empty() && (is_digit(name.back()) || name.back() == '_')) name.remove_suffix(1);
  const std::string word = base::lower_case(name);
  constexpr std::array kBlocks{"pid", "pida", "pide", "controller", "control", "ctrl"};
  return std::any_of(kBlocks.begin(), kBlocks.end(),
                     [&](const char* block) { return word == block; });
}

bool has_letter(const std::string& text) {
  return std::any_of(text.begin(), text.end(), is_letter);
}

// Returns a text in the form that a loop file accepts (config/loop_reader.cpp).
std::string usable(const std::string& text) {
  std::string tag;
  for (char c : text) {
    if (!is_letter(c) && !is_digit(c) && c != '_' && c != '.') c = '-';
    if (c != '-' || !tag.ends_with('-')) tag += c;
  }
  while (!tag.empty() && !is_letter(tag.front()) && !is_digit(tag.front())) tag.erase(0, 1);
  while (tag.ends_with('-')) tag.pop_back();
  return tag;
}

class LoopFinder {
 public:
  LoopFinder(const std::vector<ListedTag>& tags, const std::vector<record::TagRule>& rules)
      : rules_(rules) {
    for (const ListedTag& tag : tags) {
      names_.push_back(tag.name);
      listed_.emplace(tag.name, &tag);
    }
  }

  FoundLoops find() {
    find_by_name();
    join_blocks();
    join_instruments();
    name_loops();
    FoundLoops found;
    for (const Candidate& candidate : candidates_) report(candidate, found);
    for (const std::string& name : names_) {
      if (used_.count(name) == 0) found.other_names.push_back(name);
    }
    found.idle_rules = record::idle_rules(rules_, use_);
    return found;
  }

 private:
  std::vector<LoopSignals> loops_in(const std::vector<std::string>& names,
                                    std::vector<record::RuleUse>& use) const {
    std::set<std::string> clashes;
    std::vector<LoopSignals> loops = record::find_loops(
        names, rules_, use, [&](std::string what) { clashes.insert(std::move(what)); });
    if (!clashes.empty())
      throw CommandError(kExitData, fmt::format("{}", fmt::join(clashes, "\n")));
    return loops;
  }

  void find_by_name() {
    std::unordered_map<std::string, std::size_t> by_loop;
    for (LoopSignals& loop : loops_in(names_, use_)) {
      if (loop.tag.empty()) continue;  // only a PV
      by_loop.emplace(loop.tag, candidates_.size());
      for (const std::string& name : loop.names) used_.insert(name);
      const bool by_rule = std::any_of(loop.ruled_by.begin(), loop.ruled_by.end(),
                                       [](const std::string& rule) { return !rule.empty(); });
      candidates_.push_back(
          {.path = by_rule ? std::vector<std::string>{loop.tag} : split_path(loop.tag),
           .signals = std::move(loop)});
    }
    for (const std::string& name : names_) {
      if (used_.count(name) != 0) continue;
      std::vector<record::RuleUse> ignored;
      for (const LoopSignals& alone : loops_in({name}, ignored)) {
        const auto at = by_loop.find(alone.tag);
        if (at == by_loop.end()) continue;
        for (std::size_t k = 0; k < record::kRoles; ++k) {
          std::string& guess = candidates_[at->second].guesses[k];
          if (!alone.names[k].empty() && guess.empty())
            guess = base::in_quotes(name) + " is called so, too";
        }
      }
      const std::optional<record::RuledTag> ruled = record::rule_for(rules_, name);
      if (ruled && rules_[ruled->rule].unused) continue;
      record::TagName tag = record::read_tag(name);
      if (tag.role) continue;
      const auto instrument = record::instrument_name(tag.loop);
      if (!instrument || !(instrument->is_transmitter() || instrument->is_valve())) continue;
      // Removes a suffix such as .Value.
      const std::string_view number = instrument->number;
      const auto length = static_cast<std::size_t>(number.data() + number.size() - tag.loop.data());
      Candidate candidate{.path = split_path(tag.loop.substr(0, length))};
      const Role role = instrument->is_valve() ? Role::co : Role::pv;
      candidate.signals.names[index_of(role)] = name;
      candidate.signals.units[index_of(role)] = tag.unit;
      if (ruled) {
        const record::TagRule& rule = rules_[ruled->rule];
        if (!rule.unit.empty()) candidate.signals.units[index_of(role)] = rule.unit;
        candidate.signals.ranges[index_of(role)] = rule.range;
      }
      candidates_.push_back(std::move(candidate));
    }
  }

  // Joins the signals of FIC205/PID1 and FIC205 to one loop, unless both have the same signal.
  void join_blocks() {
    std::map<std::vector<std::string>, std::vector<std::size_t>> by_folder;
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      std::vector<std::string> folder = candidates_[k].path;
      if (folder.size() > 1 && is_block(folder.back())) folder.pop_back();
      by_folder[std::move(folder)].push_back(k);
    }
    for (const auto& [folder, members] : by_folder) {
      std::array<int, record::kRoles> count{};
      for (const std::size_t k : members) {
        for (std::size_t role = 0; role < record::kRoles; ++role)
          count[role] += candidates_[k].has(static_cast<Role>(role)) ? 1 : 0;
      }
      const bool apart = std::any_of(count.begin(), count.end(), [](int n) { return n > 1; });
      if (apart) continue;
      Candidate& first = candidates_[members.front()];
      for (std::size_t m = 1; m < members.size(); ++m) {
        Candidate& other = candidates_[members[m]];
        for (std::size_t role = 0; role < record::kRoles; ++role) {
          if (!other.has(static_cast<Role>(role))) continue;
          first.take(other, static_cast<Role>(role), "in the folder " + joined(folder, "/"));
        }
        if (first.signals.kind.empty()) first.signals.kind = other.signals.kind;
        other.signals = {};
      }
      first.path = folder;
    }
    drop_empty();
  }

  // Returns the common part of the names of a loop's transmitter, valve and controller.
  static std::string key_of(const InstrumentName& name) {
    std::string key = std::string(name.before) + '\0' + name.measured;
    for (const char c : name.number) {
      if (c != '-' && c != '_' && c != ' ' && c != '.') key += c;
    }
    return key;
  }

  // Adds FT205 and FV205 to FIC205, or makes a loop of them.
  void join_instruments() {
    struct Group {
      std::optional<std::size_t> transmitter, valve, controller;
    };
    std::map<std::string, Group> groups;
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      const Candidate& candidate = candidates_[k];
      const std::string name = joined(candidate.path, "/");
      const auto instrument = record::instrument_name(name);
      if (!instrument) continue;
      Group& group = groups[key_of(*instrument)];
      const auto take_first = [k](std::optional<std::size_t>& place) {
        if (!place) place = k;
      };
      if (instrument->is_controller()) {
        take_first(group.controller);
      } else if (instrument->is_transmitter() && candidate.has(Role::pv) &&
                 !candidate.has(Role::co)) {
        take_first(group.transmitter);
      } else if (instrument->is_valve() && candidate.has(Role::co) && !candidate.has(Role::pv)) {
        take_first(group.valve);
      }
    }
    for (const auto& [key, group] : groups)
      join_group(group.transmitter, group.valve, group.controller);
    drop_empty();
  }

  void join_group(std::optional<std::size_t> transmitter, std::optional<std::size_t> valve,
                  std::optional<std::size_t> controller) {
    if (!controller) {
      if (!transmitter || !valve) return;
      controller = candidates_.size();
      Candidate made{.path = candidates_[*transmitter].path};
      const std::string tag = made.path.back();
      const auto instrument = record::instrument_name(tag);
      if (!instrument) return;
      made.path.back() =
          fmt::format("{}{}IC{}", instrument->before, instrument->measured, instrument->number);
      made.tag.guess = "of " + tag;
      candidates_.push_back(std::move(made));
    }
    Candidate& loop = candidates_[*controller];
    const auto complete = [&](std::optional<std::size_t> from, Role role) {
      if (!from || loop.has(role)) return;
      Candidate& other = candidates_[*from];
      loop.take(other, role, "the same letter and number");
      if (role == Role::co && other.has(Role::stem) && !loop.has(Role::stem))
        loop.take(other, Role::stem, "of the valve");
      other.signals = {};
    };
    complete(transmitter, Role::pv);
    complete(valve, Role::co);
  }

  void drop_empty() {
    std::erase_if(candidates_, [](const Candidate& candidate) {
      return std::all_of(candidate.signals.names.begin(), candidate.signals.names.end(),
                         [](const std::string& name) { return name.empty(); });
    });
  }

  // Names each loop by the last part of its path, with as many preceding parts as make it unique.
  void name_loops() {
    std::map<std::string, std::vector<Candidate*>> by_tag;
    for (Candidate& candidate : candidates_) {
      if (!candidate.is_whole()) continue;
      std::size_t first = candidate.path.size() - 1;
      const bool block = is_block(candidate.path.back());
      while (first > 0 &&
             (block ? first + 1 == candidate.path.size() : !has_letter(candidate.path[first]))) {
        --first;
      }
      name_from(candidate, first);
      by_tag[base::lower_case(candidate.tag.value)].push_back(&candidate);
    }
    for (const auto& [tag, same] : by_tag) {
      if (same.size() == 1) continue;
      for (Candidate* candidate : same) name_from(*candidate, 0);
    }
  }

  static void name_from(Candidate& candidate, std::size_t first) {
    const std::vector<std::string> parts(
        candidate.path.begin() + static_cast<std::ptrdiff_t>(first), candidate.path.end());
    candidate.tag.value = usable(joined(parts, "-"));
    if (candidate.tag.guess.empty() && candidate.tag.value != candidate.path.back())
      candidate.tag.guess = "of " + joined(candidate.path, "/");
  }

  const ListedTag& listed(const Candidate& candidate, Role role) const {
    return *listed_.at(candidate.signals.names[index_of(role)]);
  }

  std::string unit_of(const Candidate& candidate, Role role) const {
    if (!candidate.has(role)) return {};
    const std::string& ruled = candidate.signals.units[index_of(role)];
    return ruled.empty() ? listed(candidate, role).unit : ruled;
  }

  std::optional<SignalRange> range_of(const Candidate& candidate, Role role) const {
    if (!candidate.has(role)) return std::nullopt;
    const auto& ruled = candidate.signals.ranges[index_of(role)];
    return ruled ? ruled : listed(candidate, role).range;
  }

  void report(const Candidate& candidate, FoundLoops& found) {
    if (!candidate.is_whole()) {
      const bool of_loop =
          candidate.has(Role::sp) || candidate.has(Role::mode) || candidate.has(Role::co);
      if (of_loop && !is_loose_instrument(candidate)) {
        found.incomplete.push_back(fmt::format("{}: no {}", joined(candidate.path, "/"),
                                               candidate.has(Role::pv)   ? "CO"
                                               : candidate.has(Role::co) ? "PV"
                                                                         : "PV and no CO"));
      }
      for (const std::string& name : candidate.signals.names) used_.erase(name);
      return;
    }
    FoundLoop loop;
    loop.tag = candidate.tag;
    for (std::size_t k = 0; k < record::kRoles; ++k) {
      const std::string& name = candidate.signals.names[k];
      if (name.empty()) continue;
      used_.insert(name);
      loop.signals[k] = LoopSignal{name, listed_.at(name)->node, candidate.guesses[k]};
      if (loop.description.empty()) loop.description = listed_.at(name)->description;
    }
    find_units(candidate, loop);
    if (candidate.has(Role::mode)) {
      find_mode(candidate.signals.mode_words.get(), listed(candidate, Role::mode), loop);
    }
    found.loops.push_back(std::move(loop));
  }

  // Returns whether a candidate is only a valve's tag, such as FV205 of a valve without controller.
  static bool is_loose_instrument(const Candidate& candidate) {
    const auto instrument = record::instrument_name(joined(candidate.path, "/"));
    return instrument && !instrument->is_controller();
  }

  void find_units(const Candidate& candidate, FoundLoop& loop) const {
    constexpr const char* kAsSp = "as SP's";
    loop.pv_unit.value = unit_of(candidate, Role::pv);
    if (loop.pv_unit.value.empty()) loop.pv_unit = {unit_of(candidate, Role::sp), kAsSp};
    loop.pv_range.value = range_of(candidate, Role::pv);
    if (!loop.pv_range.value) loop.pv_range = {range_of(candidate, Role::sp), kAsSp};
    loop.co_unit.value = unit_of(candidate, Role::co);
    loop.co_range.value = range_of(candidate, Role::co);
    constexpr SignalRange kPercent{0.0, 100.0};
    if (loop.co_unit.value.empty() && loop.co_range.value == kPercent) {
      loop.co_unit = {"%", "CO runs from 0 to 100"};
    } else if (loop.co_unit.value == "%" && !loop.co_range.value) {
      loop.co_range = {kPercent, "CO is in %"};
    }
  }

  static void find_mode(const record::ModeWords* rule, const ListedTag& tag, FoundLoop& loop) {
    const auto add = [&](const std::vector<std::string>& texts, std::vector<std::string>& values) {
      for (const std::string& text : texts) {
        double number = 0.0;
        const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), number);
        const bool is_number = wrong == std::errc() && end == text.data() + text.size();
        if (is_number) values.push_back(text);
        // A rule ignores the case, a loop file does not.
        if (!is_number && tag.is_text) {
          values.push_back(in_case_of(text, tag.value));
        }
      }
    };
    if (rule != nullptr) {
      add(rule->automatic, loop.automatic.value);
      add(rule->cascade, loop.automatic.value);
      add(rule->manual, loop.manual.value);
    }
    if (!loop.automatic.value.empty()) return;
    if (tag.is_text) return guess_words(tag.value, loop);
    constexpr const char* kUsual = "as most often";
    loop.automatic = {{kAutomatic}, kUsual};
    loop.manual = {{kManual}, kUsual};
  }

  // `present`: the mode's present value; empty: not known.
  static void guess_words(const std::string& present, FoundLoop& loop) {
    for (const std::string_view word : kAutomaticWords) {
      loop.automatic.value.push_back(in_case_of(word, present));
    }
    for (const std::string_view word : kManualWords) {
      loop.manual.value.push_back(in_case_of(word, present));
    }
    const auto has = [&](const std::vector<std::string>& words) {
      return std::find(words.begin(), words.end(), present) != words.end();
    };
    loop.automatic.guess = loop.manual.guess = "words of common controllers";
    if (present.empty()) return;
    const bool known = has(loop.automatic.value) || has(loop.manual.value);
    loop.automatic.guess +=
        fmt::format("; it is {} now{}", base::in_quotes(present),
                    known ? "" : ", which is in neither list: add it to one of them");
  }

  const std::vector<record::TagRule>& rules_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, const ListedTag*> listed_;
  std::vector<record::RuleUse> use_;
  std::vector<Candidate> candidates_;
  std::set<std::string> used_;
};

}  // namespace

FoundLoops find_loops(const std::vector<ListedTag>& tags,
                      const std::vector<record::TagRule>& rules) {
  return LoopFinder(tags, rules).find();
}

}  // namespace loopwarden::workbench::discover
